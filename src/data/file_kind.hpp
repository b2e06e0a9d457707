#pragma once

#include <string>

namespace sdvo {

/// Names a file that cannot be what is wanted, with the remedy, by its first bytes: an HTML page, a pointer of Git-LFS,
/// a bag of ROS 2, an archive …. Empty: nothing of these, or it cannot be read.
std::string otherKindOf(const std::string& path);
/// Of the first bytes of a file.
std::string otherKindOfBytes(const std::string& begin);

}  // namespace sdvo
