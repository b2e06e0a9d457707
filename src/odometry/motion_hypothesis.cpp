#include "stereo_descriptor_vo/odometry/motion_hypothesis.hpp"

#include <algorithm>
#include <bitset>
#include <cstddef>

namespace sdvo {
namespace {

bool contains(const std::vector<int>& values, int value) {
  return std::find(values.begin(), values.end(), value) != values.end();
}

}  // namespace

bool MotionHypothesis::isLasting(int match) const {
  constexpr int kPairs = 4;
  return view->seen[matches[match].reference] >= kPairs;
}

std::vector<int> MotionHypothesis::inlierRows(const std::vector<int>& rejected) const {
  std::vector<int> rows;
  rows.reserve(motion.inliers.size());
  for (const int i : motion.inliers)
    if (!contains(rejected, matches[i].current)) rows.push_back(matches[i].current);
  return rows;
}

int MotionHypothesis::lastingInliers(const std::vector<int>& rejected) const {
  return static_cast<int>(std::count_if(motion.inliers.begin(), motion.inliers.end(), [&](int i) {
    return isLasting(i) && !contains(rejected, matches[i].current);
  }));
}

double coverage(const StereoFeatures& features, const std::vector<int>& rows) {
  constexpr int kColumns = 8, kRows = 4;
  std::bitset<kColumns * kRows> cells;
  // Clamped before it becomes an integer, which a position far outside of the image overflows.
  const auto cell = [](double position, int size, int cells) {
    return static_cast<std::size_t>(std::clamp(position * cells / size, 0.0, cells - 1.0));
  };
  for (const int i : rows)
    cells.set(cell(features.v[i], features.camera.height, kRows) * kColumns +
              cell(features.u[i], features.camera.width, kColumns));
  return static_cast<double>(cells.count()) / (kColumns * kRows);
}

}  // namespace sdvo
