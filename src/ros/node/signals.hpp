#pragma once

#include <signal.h>

namespace sdvo {

/// SIGTERM and SIGHUP (of systemd, of a closed terminal) end this process as SIGINT does, unless it has decided on them.
/// By roscpp's own handler, for this library may be unloaded. Call it after ROS has started.
inline void endAsBySigint() {
  struct sigaction as_sigint {};
  if (::sigaction(SIGINT, nullptr, &as_sigint) != 0) return;
  for (const int signal : {SIGTERM, SIGHUP}) {
    struct sigaction now {};
    const bool is_undecided =
        ::sigaction(signal, nullptr, &now) == 0 && (now.sa_flags & SA_SIGINFO) == 0 && now.sa_handler == SIG_DFL;
    if (is_undecided) ::sigaction(signal, &as_sigint, nullptr);
  }
}

}  // namespace sdvo
