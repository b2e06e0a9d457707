#pragma once

#include <cmath>

namespace sdvo {

/// Sum of log(1 + x) over many x >= 0, by the logarithm of their products: a robust kernel's cost costs a
/// multiplication then.
class LogSum {
 public:
  void add(double x) {
    constexpr double kFarFromOverflow = 1e150;
    product_ *= 1.0 + x;
    if (product_ > kFarFromOverflow) {
      sum_ += std::log(product_);
      product_ = 1.0;
    }
  }
  double value() const { return sum_ + std::log(product_); }

 private:
  double product_ = 1.0, sum_ = 0.0;
};

}  // namespace sdvo
