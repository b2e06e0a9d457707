#include "repeated_images.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "../belief/motion_hypotheses.hpp"
#include "../motion/noise.hpp"

namespace sdvo {
namespace {

/// Nats that it takes to say which `some` of `all` things are of one kind.
double entropyOf(int some, int all) {
  const auto nats = [all](int n) { return n > 0 ? n * std::log(static_cast<double>(all) / n) : 0.0; };
  return nats(some) + nats(all - some);
}

/// Whether a motion would have moved each feature by more than `noise`, px.
std::vector<bool> movedBy(const Eigen::Isometry3d& T_previous_current, const StereoFeatures& features, double noise) {
  const Eigen::Isometry3d T_current_previous = T_previous_current.inverse();
  std::vector<bool> moved(features.u.size());
  for (int i = 0; i < features.count(); ++i) {
    const Eigen::Vector3d now = features.camera.project(T_current_previous * features.point(i));
    moved[i] = std::hypot(now.x() - features.u[i], now.y() - features.v[i]) > noise;
  }
  return moved;
}

}  // namespace

bool RepeatedImages::repeat(const StereoFeatures& features) const {
  return features.count() > 0 && features_[0] == features.u && features_[1] == features.v &&
         features_[2] == features.disparity;
}

bool RepeatedImages::shouldHaveMoved(const StereoFeatures& features, double noise,
                                     const Eigen::Isometry3d& T_previous_current) {
  const std::vector<bool> moved = movedBy(T_previous_current, features, noise);
  return 2 * std::count(moved.begin(), moved.end(), true) > features.count();
}

double RepeatedImages::logOddsOfOld(double noise) const {
  if (have_noise_) return *have_noise_ ? kCertain : kUnsuspected;
  // The noise that noiseOf() finds, grey levels, is about log-normal: medians of 0.6 in images without noise (four
  // rendered drives, by their texture) and of 1.8 in those of cameras (six recorded drives), spread by a third.
  constexpr double kWithout = 0.6, kWith = 1.8, kSpread = 1.0 / 3.0;
  const double middle = std::sqrt(kWithout * kWith);
  return std::clamp(std::log(kWith / kWithout) / (kSpread * kSpread) * std::log(noise / middle), 0.0, kCertain);
}

/// Whether each feature has exactly the position of a feature of the previous pair.
std::vector<bool> RepeatedImages::repeated(const StereoFeatures& features) const {
  std::vector<std::pair<float, float>> before(features_[0].size());
  for (std::size_t i = 0; i < before.size(); ++i) before[i] = {features_[0][i], features_[1][i]};
  std::sort(before.begin(), before.end());
  std::vector<bool> repeated(features.u.size());
  for (std::size_t i = 0; i < repeated.size(); ++i)
    repeated[i] = std::binary_search(before.begin(), before.end(), std::pair(features.u[i], features.v[i]));
  return repeated;
}

std::vector<int> RepeatedImages::newFeatures(const StereoFeatures& features, double noise,
                                             const std::optional<Eigen::Isometry3d>& T_previous_current) const {
  std::vector<int> indices(features.u.size());
  std::iota(indices.begin(), indices.end(), 0);
  if (!T_previous_current) return indices;
  // Features that the motion would not move have equal positions in new images, too.
  const std::vector<bool> moved = movedBy(*T_previous_current, features, noise);
  const std::vector<bool> repeated = this->repeated(features);
  std::vector<int> order;
  int all_old = 0;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (!moved[i]) continue;
    order.push_back(static_cast<int>(i));
    all_old += repeated[i];
  }
  const int count = static_cast<int>(order.size());
  if (all_old < kFewestMeasured || count - all_old < kFewestMeasured) return indices;
  std::sort(order.begin(), order.end(), [&](int a, int b) { return features.v[a] < features.v[b]; });
  std::vector<int> old{0};  // old[k]: repeated ones among the uppermost k
  for (const int i : order) old.push_back(old.back() + repeated[i]);
  int best = 0, border = 0;
  bool is_above = false;  // the repeated part is above the border
  for (int k = 0; k <= count; ++k) {
    // Features that have the right label if the repeated part is below the border, or above it.
    const int if_below = k - old[k] + all_old - old[k], if_above = count - if_below;
    if (std::max(if_below, if_above) <= best) continue;
    best = std::max(if_below, if_above), border = k, is_above = if_above > if_below;
  }
  // Given a border, labels (repeated or new) need fewer nats. The best of count + 1 random borders must save less.
  const double saved = entropyOf(all_old, count) - entropyOf(count - best, count);
  if (saved < std::log((count + 1) / kTailProbability)) return indices;
  const float tear = features.v[order[std::clamp(is_above ? border : border - 1, 0, count - 1)]];
  // A descriptor across the tear has content of two moments.
  const auto is_old = [&](int i) {
    const float below = features.v[i] - tear;
    return std::abs(below) < 0.5f * features.size[i] || (is_above ? below < 0.f : below > 0.f);
  };
  indices.erase(std::remove_if(indices.begin(), indices.end(), is_old), indices.end());
  return indices;
}

void RepeatedImages::remember(const StereoFeatures& features, std::optional<bool> stood) {
  constexpr int kStill = 4;  // pairs (chosen): a slow start looks like standstill for two
  const bool repeats = repeat(features);
  if (!repeats) single_ = in_a_row_ == 1 ? single_ + 1 : 0;
  in_a_row_ = repeats ? in_a_row_ + 1 : 0;
  // Images repeated while the camera stood, and a confirmed motion follows: they have no noise.
  if (!repeats && stood.has_value() && still_repeats_ >= kStill) have_noise_ = false;
  still_ = stood.value_or(false) && !repeats ? still_ + 1 : 0;
  still_repeats_ = stood.value_or(false) && repeats ? still_repeats_ + 1 : 0;
  if (still_ >= kStill) {
    // A mover changes the pair, but without noise most features keep their exact positions.
    const std::vector<bool> repeated = this->repeated(features);
    have_noise_ = 2 * std::count(repeated.begin(), repeated.end(), true) < features.count();
  }
  features_ = {features.u, features.v, features.disparity};
}

}  // namespace sdvo
