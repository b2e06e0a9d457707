#pragma once

#if __cplusplus < 201703L
#error stereo_descriptor_vo needs C++17: set(CMAKE_CXX_STANDARD 17)
#include "this ends the compilation, which would only say the same in many other words"
#endif
