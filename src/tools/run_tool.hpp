#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>

#include "../check/finding.hpp"

namespace sdvo {

/// Exit code of a verdict; 1 stands for an error.
inline int exitCodeOf(Verdict verdict) {
  return verdict == Verdict::kFail ? 2 : 0;
}

/// The main() of every tool: parses the command line, run `work` (returns the exit code), and report any failure as
/// one line "error: …" on stderr with exit code 1.
template <class Work>
int runTool(CLI::App& app, int argc, char** argv, const Work& work) {
  const auto fail = [](std::string what) {
    std::replace(what.begin(), what.end(), '\n', ' ');
    std::cerr << "error: " << what << std::endl;
    return 1;
  };
  app.set_version_flag("--version", SDVO_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return e.get_exit_code() == 0 ? app.exit(e) : fail(std::string(e.what()) + " (see --help)");
  }
  try {
    const int exit_code = work();
    if (std::cout.flush().fail() || std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
      return fail("cannot write to the standard output: is the disk full?");
    return exit_code;
  } catch (const std::exception& e) {
    return fail(e.what());
  }
}

}  // namespace sdvo
