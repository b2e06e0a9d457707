#include "stereo_descriptor_vo/odometry/feature_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <type_traits>

// The population count of 64 bits is one instruction on every x86 processor since 2008, but only a function compiled
// for it may use it; the loader picks the right version.
// The thread sanitizer is not up yet when the loader picks.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define SDVO_POPCOUNT __attribute__((target_clones("popcnt", "default")))
#else
#define SDVO_POPCOUNT
#endif

namespace sdvo {
namespace {

constexpr float kNoDistance = std::numeric_limits<float>::max();

SDVO_POPCOUNT void hammingDistances(const std::uint8_t* row, const cv::Mat& others, const std::vector<int>& candidates,
                                    std::vector<float>& distances) {
  const int words = others.cols / 8;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const std::uint8_t* other = others.ptr(candidates[k]);
    int distance = 0;
    for (int w = 0; w < words; ++w) {
      std::uint64_t a, b;
      std::memcpy(&a, row + 8 * w, 8);
      std::memcpy(&b, other + 8 * w, 8);
      distance += __builtin_popcountll(a ^ b);
    }
    for (int byte = 8 * words; byte < others.cols; ++byte)
      distance += __builtin_popcount(static_cast<unsigned>(row[byte] ^ other[byte]));
    distances[k] = static_cast<float>(distance);
  }
}

/// Squared L2 distances of rows of whole numbers 0…255 or of floats.
template <class Element>
void squaredDistances(const std::uint8_t* row, const cv::Mat& others, const std::vector<int>& candidates,
                      std::vector<float>& distances) {
  const int count = others.cols / static_cast<int>(sizeof(Element));
  const auto* a = reinterpret_cast<const Element*>(row);
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const auto* b = reinterpret_cast<const Element*>(others.ptr(candidates[k]));
    using Sum = std::conditional_t<std::is_integral_v<Element>, int, float>;
    Sum sum = 0;
    for (int e = 0; e < count; ++e) {
      const Sum difference = static_cast<Sum>(a[e]) - static_cast<Sum>(b[e]);
      sum += difference * difference;
    }
    distances[k] = static_cast<float>(sum);
  }
}

void computeDistances(ElementType type, const std::uint8_t* row, const cv::Mat& others,
                      const std::vector<int>& candidates, std::vector<float>& distances) {
  switch (type) {
    case ElementType::kBits:
      return hammingDistances(row, others, candidates, distances);
    case ElementType::kUint8:
      return squaredDistances<std::uint8_t>(row, others, candidates, distances);
    case ElementType::kFloat32:
      return squaredDistances<float>(row, others, candidates, distances);
  }
}

/// What turns a distance into a share in [0, 1]: the number of bits, or the sum of both rows' squared lengths
/// (orthogonal rows of whatever length are at 1 then).
float distanceUnit(ElementType type, const cv::Mat& a, int row_a, const cv::Mat& b, int row_b) {
  if (type == ElementType::kBits) return 8.f * static_cast<float>(a.cols);
  const cv::Mat zeros = cv::Mat::zeros(1, a.cols, CV_8U);
  std::vector<float> lengths(1);
  computeDistances(type, a.ptr(row_a), zeros, {0}, lengths);
  const float length_a = lengths[0];
  computeDistances(type, b.ptr(row_b), zeros, {0}, lengths);
  return std::max(length_a + lengths[0], 1e-12f);
}

/// Rows of a feature set, found by position.
class PositionGrid {
 public:
  PositionGrid(const StereoFeatures& features, double radius) : radius_(static_cast<float>(radius)) {
    columns_ = static_cast<int>(features.camera.width / cell()) + 1;
    rows_ = static_cast<int>(features.camera.height / cell()) + 1;
    cells_.resize(static_cast<std::size_t>(columns_) * rows_);
    for (int i = 0; i < features.count(); ++i) {
      const float u = features.u[i], v = features.v[i];
      cells_[static_cast<std::size_t>(clampedRow(v)) * columns_ + clampedColumn(u)].push_back({u, v, i});
    }
  }

  void findAround(float u, float v, std::vector<int>& found) const {
    found.clear();
    const int first = clampedColumn(u - radius_), last = clampedColumn(u + radius_);
    for (int row = clampedRow(v - radius_); row <= clampedRow(v + radius_); ++row)
      for (int column = first; column <= last; ++column)
        for (const Entry& entry : cells_[static_cast<std::size_t>(row) * columns_ + column]) {
          const float du = entry.u - u, dv = entry.v - v;
          if (du * du + dv * dv <= radius_ * radius_) found.push_back(entry.row);
        }
  }

 private:
  struct Entry {
    float u, v;
    int row;
  };

  float cell() const { return 0.5f * radius_; }
  int clampedColumn(float u) const {
    return static_cast<int>(std::clamp(u / cell(), 0.f, static_cast<float>(columns_ - 1)));
  }
  int clampedRow(float v) const { return static_cast<int>(std::clamp(v / cell(), 0.f, static_cast<float>(rows_ - 1))); }

  float radius_;
  int columns_, rows_;
  std::vector<std::vector<Entry>> cells_;
};

void checkComparable(const StereoFeatures& a, const StereoFeatures& b) {
  if (a.descriptor != b.descriptor || a.element_type != b.element_type || a.layout != b.layout ||
      a.descriptors.cols != b.descriptors.cols)
    throw std::invalid_argument("descriptors cannot be compared: " + a.descriptor + " (" + a.layout + ") against " +
                                b.descriptor + " (" + b.layout + ")");
}

}  // namespace

FeatureMatcher::FeatureMatcher(const FeatureMatcherOptions& options) : options_(checked(options)) {}

std::vector<FeatureMatch> FeatureMatcher::match(const StereoFeatures& reference, const StereoFeatures& current,
                                                const std::optional<Eigen::Isometry3d>& T_current_reference) const {
  if (reference.count() == 0 || current.count() == 0) return {};
  checkComparable(reference, current);

  const bool gated = options_.gating && T_current_reference.has_value();
  const PositionGrid grid(current, gated ? options_.gate_radius : 1e9);
  std::vector<int> everything(static_cast<std::size_t>(current.count()));
  for (int i = 0; i < current.count(); ++i) everything[i] = i;

  struct Nearest {
    int index = -1;
    float distance = kNoDistance;
  };
  std::vector<Nearest> of_reference(reference.count()), of_current(current.count());
  std::vector<int> found;
  std::vector<float> distances(current.count());
  for (int i = 0; i < reference.count(); ++i) {
    if (gated) {
      const Eigen::Vector3d point = *T_current_reference * reference.point(i);
      constexpr double kNearestDepth = 0.1;  // m: what passes closer than this cannot be seen again
      if (point.z() < kNearestDepth) continue;
      const Eigen::Vector3d predicted = current.camera.project(point);
      grid.findAround(static_cast<float>(predicted.x()), static_cast<float>(predicted.y()), found);
    }
    const std::vector<int>& candidates = gated ? found : everything;
    computeDistances(reference.element_type, reference.descriptors.ptr(i), current.descriptors, candidates, distances);
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      const int j = candidates[k];
      if (distances[k] < of_reference[i].distance) of_reference[i] = {j, distances[k]};
      if (distances[k] < of_current[j].distance) of_current[j] = {i, distances[k]};
    }
  }

  std::vector<FeatureMatch> matches;
  for (int i = 0; i < reference.count(); ++i) {
    const auto& [j, distance] = of_reference[i];
    if (j < 0 || of_current[j].index != i) continue;
    const float share =
        distance / distanceUnit(reference.element_type, reference.descriptors, i, current.descriptors, j);
    if (share <= options_.max_distance) matches.push_back({i, j, share});
  }
  return matches;
}

}  // namespace sdvo
