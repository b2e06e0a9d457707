#pragma once

#include <cstdint>

namespace sdvo {

/// Lets items through at a limited rate, by their stamps. Twice as many as allowed leave every second one: a twentieth
/// of the period is granted to stamps that jitter.
class Pace {
 public:
  /// `max_rate`: Hz; 0: no limit.
  explicit Pace(double max_rate) : period_(max_rate > 0.0 ? static_cast<std::int64_t>(1e9 / max_rate) : 0) {}

  /// Whether the item of this stamp (ns) goes through. Stamps that fall begin anew.
  bool isDue(std::int64_t stamp) {
    if (has_begun_ && stamp > last_ && stamp - last_ < period_ - period_ / 20) return false;
    has_begun_ = true;
    last_ = stamp;
    return true;
  }

 private:
  std::int64_t period_;
  std::int64_t last_ = 0;  ///< that went through
  bool has_begun_ = false;
};

}  // namespace sdvo
