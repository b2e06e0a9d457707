#pragma once

#include <cmath>
#include <cstdint>

namespace sdvo::render {

/// Bit mixer (SplitMix64's finaliser): equal on every machine and independent of the order of calls, which is what
/// makes a drive the same whatever the number of threads.
inline std::uint64_t mixBits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// Small deterministic generator; the standard library's distributions differ between implementations.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0) : state_(mixBits(seed) ^ mixBits(~stream)) {}

  std::uint64_t bits() { return mixBits(state_++); }
  /// In [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
  double uniform(double min, double max) { return min + (max - min) * uniform(); }
  /// In 0 … count - 1.
  int index(int count) { return static_cast<int>(uniform() * count); }
  bool chance(double probability) { return uniform() < probability; }
  /// Standard normal.
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * M_PI * uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace sdvo::render
