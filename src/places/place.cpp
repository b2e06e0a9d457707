#include "stereo_descriptor_vo/places/place.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace sdvo {

std::size_t Place::bytes() const {
  std::size_t bytes = sizeof(Place) + features.descriptors.total() * features.descriptors.elemSize();
  StereoFeatures::forEachArray(
      [&](const char*, auto array, auto) { bytes += (features.*array).size() * sizeof(float); });
  return bytes;
}

StereoFeatures thinOut(const StereoFeatures& features, int most) {
  constexpr int kColumns = 8, kRows = 4;
  std::array<std::vector<int>, kColumns * kRows> cells;
  for (int i = 0; i < features.count(); ++i) {
    const int column = static_cast<int>(features.u[i] * kColumns / static_cast<float>(features.camera.width));
    const int row = static_cast<int>(features.v[i] * kRows / static_cast<float>(features.camera.height));
    cells[std::clamp(row, 0, kRows - 1) * kColumns + std::clamp(column, 0, kColumns - 1)].push_back(i);
  }
  for (std::vector<int>& cell : cells)
    std::stable_sort(cell.begin(), cell.end(),
                     [&](int a, int b) { return features.response[a] > features.response[b]; });

  std::vector<int> rows;
  const auto wanted = static_cast<std::size_t>(std::min(most, features.count()));
  for (std::size_t turn = 0; rows.size() < wanted; ++turn)
    for (const std::vector<int>& cell : cells)
      if (turn < cell.size() && rows.size() < wanted) rows.push_back(cell[turn]);
  StereoFeatures thinned = features.select(rows);
  thinned.patches = cv::Mat();
  thinned.patch_layout = {};
  return thinned;
}

}  // namespace sdvo
