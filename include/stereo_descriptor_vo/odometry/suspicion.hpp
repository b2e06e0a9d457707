#pragma once

#include <algorithm>
#include <string>
#include <utility>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// Why pairs are doubted that look sound: the world, the rig or the map may still be as wrong as it was a moment ago.
/// While a suspicion lasts, all hypotheses of a motion are searched.
class Suspicion {
 public:
  static constexpr int kShort = 4;  // pairs (chosen: points seen by so many count as lasting)
  static constexpr int kLong = 20;  // pairs, where many matches agreed on no motion (chosen: 2 s at 10 Hz)

  bool isRaised() const { return pairs_ > 0; }

  /// In words, of the first one that lasts.
  const std::string& cause() const { return cause_; }

  /// Doubts this pair and so many after it.
  void raise(std::string cause, int pairs = kShort) {
    if (!isRaised()) cause_ = std::move(cause);
    pairs_ = std::max(pairs_, pairs + 1);
  }

  /// A pair is over.
  void pass() {
    if (pairs_ > 0) --pairs_;
  }

 private:
  int pairs_ = 0;  ///< this one included
  std::string cause_;
};

}  // namespace sdvo
