#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sdvo {

/// Folder of the running program; empty where /proc does not name it.
std::filesystem::path programFolder();

/// Exit code of a program run without a shell, which would read names of files as commands; -1 when it did not end by
/// itself. Its output goes to the file `log`, or where this program's goes when that is empty.
int runProgram(std::vector<std::string> command, const std::string& log = "");

}  // namespace sdvo
