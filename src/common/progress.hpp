#pragma once

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <utility>

namespace sdvo {

/// Progress of a known number of steps on stderr: a bar on a terminal, otherwise a line now and then, so that logs stay
/// short. The destructor ends the bar's line, hence an error message after it stands alone.
class Progress {
 public:
  Progress(std::string label, int total) : label_(std::move(label)), total_(std::max(total, 1)) { draw(); }
  ~Progress() {
    if (terminal_) std::fputc('\n', stderr);
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Call after each step.
  void step() {
    ++done_;
    const Clock::time_point now = Clock::now();
    const std::chrono::duration<double> interval(terminal_ ? 0.1 : 10.0);
    if (now - last_drawn_ < interval && !(terminal_ && done_ == total_)) return;
    last_drawn_ = now;
    draw();
  }

 private:
  using Clock = std::chrono::steady_clock;

  void draw() const {
    if (terminal_) {
      const int width = 40;
      const std::string bar(static_cast<std::size_t>(std::min<long long>(1LL * width * done_ / total_, width)), '#');
      std::fprintf(stderr, "\r%s [%-*s] %d/%d", label_.c_str(), width, bar.c_str(), done_, total_);
    } else if (done_ > 0) {
      std::fprintf(stderr, "%s %d/%d\n", label_.c_str(), done_, total_);
    }
    std::fflush(stderr);
  }

  std::string label_;
  int total_;
  int done_ = 0;
  bool terminal_ = isatty(STDERR_FILENO) == 1;
  Clock::time_point last_drawn_ = Clock::now();
};

}  // namespace sdvo
