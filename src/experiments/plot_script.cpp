#include "plot_script.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <iostream>
#include <optional>

namespace sdvo {
namespace {

namespace fs = std::filesystem;

/// A workspace keeps its programs some folders below the sources, hence the walk upwards.
std::optional<fs::path> findScript(const std::string& script) {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return std::nullopt;
  for (fs::path folder = program.parent_path();; folder = folder.parent_path()) {
    for (const fs::path& candidate : {folder / script, folder / "scripts" / script})
      if (fs::is_regular_file(candidate, error)) return candidate;
    if (folder == folder.root_path()) return std::nullopt;
  }
}

/// Exit code of a program run without a shell, which would read names of files as commands.
int run(std::vector<std::string> command) {
  std::vector<char*> argv;
  for (std::string& word : command) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    execvp(argv[0], argv.data());
    _exit(127);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

}  // namespace

void runPlotScript(const std::string& script, const std::vector<std::string>& arguments) {
  const std::optional<fs::path> found = findScript(script);
  // The Python of the build: one from elsewhere that comes first on PATH may lack matplotlib.
  std::vector<std::string> command = {fs::exists(SDVO_PYTHON) ? SDVO_PYTHON : "python3",
                                      found ? found->string() : script};
  command.insert(command.end(), arguments.begin(), arguments.end());
  if (found && run(command) == 0) return;
  std::cerr << (found ? "plotting failed (is python3-matplotlib installed?)" : "the plot script was not found")
            << "; to plot by hand run:";
  for (const std::string& word : command) std::cerr << " " << word;
  std::cerr << std::endl;
}

}  // namespace sdvo
