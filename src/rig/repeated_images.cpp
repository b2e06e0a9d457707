#include "stereo_descriptor_vo/rig/repeated_images.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "stereo_descriptor_vo/motion/noise.hpp"

namespace sdvo {
namespace {

/// Of so many things of which some are of one kind, nats.
double entropyOf(int some, int all) {
  const auto nats = [all](int n) { return n > 0 ? n * std::log(static_cast<double>(all) / n) : 0.0; };
  return nats(some) + nats(all - some);
}

}  // namespace

bool RepeatedImages::areFrozen(const StereoFeatures& features, double noise,
                               const std::optional<Eigen::Isometry3d>& T_previous_current, bool is_measured) const {
  if (features.count() == 0 || features_[0] != features.u || features_[1] != features.v ||
      features_[2] != features.disparity)
    return false;
  if (!is_measured && frozen_) return true;
  if (!T_previous_current) return false;
  const Eigen::Isometry3d T_current_previous = T_previous_current->inverse();
  int moved = 0;
  for (int i = 0; i < features.count(); ++i) {
    const Eigen::Vector3d point = features.camera.backProject(features.u[i], features.v[i], features.disparity[i]);
    const Eigen::Vector3d now = features.camera.project(T_current_previous * point);
    moved += std::hypot(now.x() - features.u[i], now.y() - features.v[i]) > noise;
  }
  return 2 * moved > features.count();
}

std::vector<int> RepeatedImages::newRows(const StereoFeatures& features) const {
  std::vector<int> rows(features.u.size());
  std::iota(rows.begin(), rows.end(), 0);
  std::vector<std::pair<float, float>> before(features_[0].size());
  for (std::size_t i = 0; i < before.size(); ++i) before[i] = {features_[0][i], features_[1][i]};
  std::sort(before.begin(), before.end());
  std::vector<bool> repeated(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    repeated[i] = std::binary_search(before.begin(), before.end(), std::pair(features.u[i], features.v[i]));
  const int count = features.count(), all_old = static_cast<int>(std::count(repeated.begin(), repeated.end(), true));
  if (all_old < kFewestMeasured || count - all_old < kFewestMeasured) return rows;
  std::vector<int> order = rows;
  std::sort(order.begin(), order.end(), [&](int a, int b) { return features.v[a] < features.v[b]; });
  std::vector<int> old{0};  // among the first so many from above
  for (const int i : order) old.push_back(old.back() + repeated[static_cast<std::size_t>(i)]);
  int best = 0, border = 0;
  bool is_above = false;  // the old part
  for (int k = 0; k <= count; ++k) {
    const int below = k - old[k] + all_old - old[k], above = count - below;
    if (std::max(below, above) <= best) continue;
    best = std::max(below, above), border = k, is_above = above > below;
  }
  // Matches err at the tear. How much fewer nats tell old from new, against what some border of chance saves.
  const double saved = entropyOf(all_old, count) - entropyOf(count - best, count);
  if (saved < std::log((count + 1) / kTailProbability)) return rows;
  const float tear =
      features.v[order[static_cast<std::size_t>(std::clamp(is_above ? border : border - 1, 0, count - 1))]];
  rows.assign(is_above ? order.begin() + border : order.begin(), is_above ? order.end() : order.begin() + border);
  // A descriptor across the tear shows no point of the scene.
  const auto is_torn = [&](int i) { return std::abs(features.v[i] - tear) < 0.5f * features.size[i]; };
  rows.erase(std::remove_if(rows.begin(), rows.end(), is_torn), rows.end());
  std::sort(rows.begin(), rows.end());
  return rows;
}

void RepeatedImages::remember(const StereoFeatures& features, bool frozen) {
  features_ = {features.u, features.v, features.disparity};
  frozen_ = frozen;
}

}  // namespace sdvo
