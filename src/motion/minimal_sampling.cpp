#include "stereo_descriptor_vo/motion/minimal_sampling.hpp"

#include <algorithm>
#include <cmath>

namespace sdvo {

MinimalSample drawSample(std::mt19937& random, int count) {
  MinimalSample sample{};
  for (std::size_t k = 0; k < sample.size();) {
    sample[k] = static_cast<int>(random() % static_cast<unsigned>(count));
    if (std::find(sample.begin(), sample.begin() + k, sample[k]) == sample.begin() + k) ++k;
  }
  return sample;
}

SampleBudget::SampleBudget(int at_most, double confidence)
    : at_most_(at_most), confidence_(confidence), needed_(at_most) {}

void SampleBudget::noteInliers(double share) {
  // Fischler and Bolles 1981.
  const double all_inliers = share * share * share;
  if (all_inliers >= 1.0)
    needed_ = 1.0;
  else if (all_inliers <= 1e-12)
    needed_ = at_most_;
  else
    needed_ = std::log(1.0 - confidence_) / std::log(1.0 - all_inliers);
}

bool SampleBudget::spent(int samples) const {
  return samples >= std::min(needed_, at_most_);
}

double SampleBudget::progress(int samples) const {
  return std::min(1.0, samples / std::max(1.0, std::min(needed_, at_most_)));
}

}  // namespace sdvo
