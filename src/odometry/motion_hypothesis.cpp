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
  for (const int i : rows) {
    const int column = static_cast<int>(features.u[i] * kColumns / features.camera.width);
    const int row = static_cast<int>(features.v[i] * kRows / features.camera.height);
    cells.set(static_cast<std::size_t>(std::clamp(row, 0, kRows - 1) * kColumns + std::clamp(column, 0, kColumns - 1)));
  }
  return static_cast<double>(cells.count()) / (kColumns * kRows);
}

}  // namespace sdvo
