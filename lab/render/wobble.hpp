#pragma once

#include <cmath>

#include "random.hpp"

namespace sdvo::render {

/// Smooth zero-mean signal with unit variance: a few sines of random phase between two frequencies (Hz).
class Wobble {
 public:
  Wobble(Random& random, double min_frequency, double max_frequency) {
    for (Sine& sine : sines_) sine = {random.uniform(min_frequency, max_frequency), random.uniform(0.0, 2.0 * M_PI)};
  }
  double operator()(double time) const {
    double sum = 0.0;
    for (const Sine& sine : sines_) sum += std::sin(2.0 * M_PI * sine.frequency * time + sine.phase);
    return sum * std::sqrt(2.0 / kCount);
  }

 private:
  static constexpr int kCount = 5;
  struct Sine {
    double frequency, phase;
  };
  Sine sines_[kCount];
};

}  // namespace sdvo::render
