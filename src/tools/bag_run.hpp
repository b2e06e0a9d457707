#pragma once

#include <ros/time.h>

#include <optional>
#include <string>
#include <vector>

#include "../config/pipeline_options.hpp"
#include "../ros/pair_decoder.hpp"
#include "bag_pairs.hpp"
#include "feature_halves.hpp"
#include "offline_run.hpp"
#include "self_check.hpp"

namespace sdvo {

/// The odometry on every pair of a recorded bag, and what its pairs say of its precision.
class BagRun {
 public:
  /// `with_halves`: two more odometries run on a half of the features each. Throws std::runtime_error where the bag
  /// cannot be read or no pair can be used.
  BagRun(const std::string& bag, const std::string& camera, const PipelineOptions& options, bool with_halves);

  const OfflineRun& whole() const { return whole_; }
  /// Stamps that made no pair, and pairs that were late or refused.
  int leftOut() const { return left_out_; }

  /// Reads the bag again, backwards.
  SelfCheck shuttle() const;
  /// Needs `with_halves`.
  SelfCheck halves() const { return checkHalves(whole_, halves_->first, halves_->second); }

 private:
  struct Recorded {
    StereoPairMessages messages;
    BagPairs::Times times;
  };
  struct Used {
    ros::Time stamp;
    BagPairs::Times times;
  };
  struct Halves {
    FeatureHalves features;
    OfflineRun first, second;
  };
  void process(const Recorded& pair);

  PipelineOptions options_;
  BagPairs pairs_;
  PairDecoder decoder_;
  OfflineRun whole_;
  std::optional<Halves> halves_;
  std::vector<Used> used_;
  int left_out_ = 0;
};

}  // namespace sdvo
