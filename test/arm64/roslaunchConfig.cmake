# See catkinConfig.cmake.
