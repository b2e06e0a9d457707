#pragma once

#include <string>

namespace sdvo {

enum class Verdict { kOk, kWarn, kFail, kOpen };

inline const char* toString(Verdict verdict) {
  switch (verdict) {
    case Verdict::kOk:
      return "OK";
    case Verdict::kWarn:
      return "WARN";
    case Verdict::kFail:
      return "FAIL";
    case Verdict::kOpen:
      break;
  }
  return "-";
}

/// The result of one step of a camera's check. kOpen: the recording does not show it.
struct Finding {
  std::string step;
  Verdict verdict;
  std::string what;    ///< the figures
  std::string remedy;  ///< what to do; empty when all is well
};

}  // namespace sdvo
