#include "plot_script.hpp"

#include <filesystem>
#include <iostream>
#include <optional>

#include "child_process.hpp"

namespace sdvo {
namespace {

namespace fs = std::filesystem;

/// A workspace keeps its programs some folders below the sources, hence the walk upwards.
std::optional<fs::path> findScript(const std::string& script) {
  std::error_code error;
  for (fs::path folder = programFolder(); !folder.empty(); folder = folder.parent_path()) {
    for (const fs::path& candidate : {folder / script, folder / "scripts" / script})
      if (fs::is_regular_file(candidate, error)) return candidate;
    if (folder == folder.root_path()) break;
  }
  return std::nullopt;
}

}  // namespace

void runPlotScript(const std::string& script, const std::vector<std::string>& arguments) {
  const std::optional<fs::path> found = findScript(script);
  // The Python of the build: one from elsewhere that comes first on PATH may lack matplotlib.
  std::vector<std::string> command = {fs::exists(SDVO_PYTHON) ? SDVO_PYTHON : "python3",
                                      found ? found->string() : script};
  command.insert(command.end(), arguments.begin(), arguments.end());
  if (found && runProgram(command) == 0) return;
  std::cerr << (found ? "plotting failed (is python3-matplotlib installed?)" : "the plot script was not found")
            << "; to plot by hand run:";
  for (const std::string& word : command) std::cerr << " " << word;
  std::cerr << std::endl;
}

}  // namespace sdvo
