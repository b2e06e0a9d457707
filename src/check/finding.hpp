#pragma once

#include <locale>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace sdvo {

/// kOpen: the pairs do not suffice for a verdict.
enum class Verdict { kOk, kWarn, kFail, kOpen };

inline const char* toString(Verdict verdict) {
  constexpr const char* kNames[] = {"OK", "WARN", "FAIL", "-"};
  return kNames[static_cast<int>(verdict)];
}

/// Result of a check of a camera. /diagnostics, check_camera, pages and warnings print it.
struct Finding {
  Verdict verdict = Verdict::kOpen;
  std::string what = "";    ///< the figures
  std::string remedy = "";  ///< what to do; empty when all is well

  bool isFault() const { return verdict == Verdict::kWarn || verdict == Verdict::kFail; }

  /// For a reporter that works in spite of the fault.
  Finding asWarning() const { return {isFault() ? Verdict::kWarn : verdict, what, remedy}; }

  std::string text() const { return remedy.empty() ? what : what + ": " + remedy; }
};

/// FAIL if it fails, else WARN if it is doubtful, else OK without the remedy.
inline Finding judged(bool fails, bool is_doubtful, const std::string& what, const std::string& remedy = "") {
  if (!fails && !is_doubtful) return {Verdict::kOk, what};
  return {fails ? Verdict::kFail : Verdict::kWarn, what, remedy};
}
inline Finding failIf(bool fails, const std::string& what, const std::string& remedy) {
  return judged(fails, false, what, remedy);
}
inline Finding warnIf(bool is_doubtful, const std::string& what, const std::string& remedy) {
  return judged(false, is_doubtful, what, remedy);
}

using Findings = std::vector<Finding>;

/// Figures that /diagnostics show beside a finding, by name.
class Values {
 public:
  template <class Value>
  void add(const std::string& name, const Value& value) {
    std::ostringstream words;
    words.imbue(std::locale::classic());
    words << value;
    all_.emplace_back(name, words.str());
  }
  const std::vector<std::pair<std::string, std::string>>& all() const { return all_; }

 private:
  std::vector<std::pair<std::string, std::string>> all_;
};

/// A step of a camera's check.
struct CheckStep {
  std::string name;
  Finding finding;

  /// Without the remedy.
  std::string text() const { return std::string(toString(finding.verdict)) + ", " + name + ": " + finding.what; }
};

/// The first one of the worst verdict.
inline CheckStep worstOf(const std::vector<CheckStep>& steps) {
  for (const Verdict verdict : {Verdict::kFail, Verdict::kWarn, Verdict::kOk})
    for (const CheckStep& step : steps)
      if (step.finding.verdict == verdict) return step;
  return {"", {Verdict::kOpen, "nothing was judged"}};
}

}  // namespace sdvo
