#pragma once

#include <cstdio>
#include <string>

namespace sdvo {

/// "000042", the name of frame 42's files without their ending.
inline std::string kittiFrameName(int i) {
  char name[16];
  std::snprintf(name, sizeof name, "%06d", i);
  return name;
}

}  // namespace sdvo
