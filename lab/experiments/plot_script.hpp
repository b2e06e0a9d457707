#pragma once

#include <string>
#include <vector>

namespace sdvo {

/// Runs one of the package's plot scripts, looked for beside the program and in the scripts/ folder of the source tree
/// the program was built in, with Python. When the script is not found or fails, one line on stderr tells how to plot
/// by hand; the measurements are on disk by then, so that is no error.
void runPlotScript(const std::string& script, const std::vector<std::string>& arguments);

}  // namespace sdvo
