#pragma once

#include <functional>
#include <string>

namespace sdvo {

/// Has a file written that appears whole or not at all, and is on the disk on return: `write` is given the path of a
/// partial one beside it, of this call alone, and throws when it cannot. Links stay and lead to the new file. Throws
/// std::runtime_error that names the file, and leaves it as it was, then and when the path is not absolute or leads to
/// something else than a file.
void writeWhole(const std::string& path, const std::function<void(const std::string& partial)>& write);

}  // namespace sdvo
