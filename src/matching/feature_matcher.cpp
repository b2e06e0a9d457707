#include "stereo_descriptor_vo/matching/feature_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <stdexcept>
#include <type_traits>

#include "../motion/correspondence_arrays.hpp"
#include "hamming_distances.hpp"

namespace sdvo {
namespace {

/// Squared L2 distances of descriptors of whole numbers 0…255 or of floats.
template <class Element>
void squaredDistances(const std::uint8_t* descriptor, const cv::Mat& others, const int* candidates, std::size_t count,
                      float* distances) {
  const int elements = others.cols / static_cast<int>(sizeof(Element));
  const auto* a = reinterpret_cast<const Element*>(descriptor);
  for (std::size_t k = 0; k < count; ++k) {
    const auto* b = reinterpret_cast<const Element*>(others.ptr(candidates[k]));
    using Sum = std::conditional_t<std::is_integral_v<Element>, int, float>;
    Sum sum = 0;
    for (int e = 0; e < elements; ++e) {
      const Sum difference = static_cast<Sum>(a[e]) - static_cast<Sum>(b[e]);
      sum += difference * difference;
    }
    distances[k] = static_cast<float>(sum);
  }
}

void computeDistances(ElementType type, const std::uint8_t* descriptor, const cv::Mat& others, const int* candidates,
                      std::size_t count, float* distances) {
  switch (type) {
    case ElementType::kBits:
      return hammingDistances(descriptor, others, candidates, count, distances);
    case ElementType::kUint8:
      return squaredDistances<std::uint8_t>(descriptor, others, candidates, count, distances);
    case ElementType::kFloat32:
      return squaredDistances<float>(descriptor, others, candidates, count, distances);
  }
}

/// Preselection without a gate, where nearly all descriptors differ in half of the bits: writes the indices of those
/// whose first quarter is near enough to be within the largest distance. Returns their number.
std::size_t findAlike(const std::uint8_t* descriptor, const cv::Mat& others, double max_distance,
                      const std::vector<int>& all, std::vector<float>& distances, std::vector<int>& found) {
  // Standard deviations by which a quarter's distance may exceed the largest one: loses 1 % of the matches (KITTI 06).
  constexpr double kSigmas = 1.0;
  const cv::Mat quarter = others.colRange(0, (others.cols + 3) / 4);
  const double bits = 8.0 * quarter.cols;
  const auto most =
      static_cast<float>(bits * max_distance + kSigmas * std::sqrt(bits * max_distance * (1.0 - max_distance)));
  hammingDistances(descriptor, quarter, all.data(), all.size(), distances.data());
  std::size_t count = 0;
  for (std::size_t k = 0; k < all.size(); ++k) {
    found[count] = all[k];
    count += distances[k] <= most ? 1 : 0;
  }
  return count;
}

/// Divisor that makes a distance a ratio in [0, 1]: the number of bits, or the sum of both squared lengths, with which
/// orthogonal descriptors have the distance 1.
float distanceUnit(ElementType type, const cv::Mat& a, int i, const cv::Mat& b, int j) {
  if (type == ElementType::kBits) return 8.f * static_cast<float>(a.cols);
  const cv::Mat zeros = cv::Mat::zeros(1, a.cols, CV_8U);
  const int first = 0;
  float length_a, length_b;
  computeDistances(type, a.ptr(i), zeros, &first, 1, &length_a);
  computeDistances(type, b.ptr(j), zeros, &first, 1, &length_b);
  return std::max(length_a + length_b, 1e-12f);
}

/// The nearest candidate, of equal distances that with the smallest index. Distance and index form one number: its
/// minimum needs no branch, which the processor could not predict. The bits of non-negative floats sort as the floats.
class Nearest {
 public:
  void note(float distance, int index) { least_ = std::min(least_, numberOf(distance, index)); }
  bool found() const { return least_ != kNone; }
  float distance() const {
    const auto bits = static_cast<std::uint32_t>(least_ >> 32);
    float distance;
    std::memcpy(&distance, &bits, sizeof distance);
    return distance;
  }
  int index() const { return static_cast<int>(least_ & 0xffffffffu); }

 private:
  static std::uint64_t numberOf(float distance, int index) {
    std::uint32_t bits;
    std::memcpy(&bits, &distance, sizeof bits);
    return static_cast<std::uint64_t>(bits) << 32 | static_cast<std::uint32_t>(index);
  }

  static constexpr std::uint64_t kNone = 0x7f800000'00000000;  // at infinity, where nothing is
  std::uint64_t least_ = kNone;
};

/// Indices of a pair's features (at least one), found by position. The grid covers the features, not the image: a
/// message with a wrong image size must not make it huge.
class PositionGrid {
 public:
  PositionGrid(const StereoFeatures& features, double radius)
      : radius_(static_cast<float>(radius)), columns_(features.u, 0.5 * radius), rows_(features.v, radius) {
    const auto cellOf = [&](int i) { return cell(columns_.at(features.u[i]), rows_.at(features.v[i])); };
    begin_.assign(static_cast<std::size_t>(columns_.count()) * rows_.count() + 1, 0);
    for (int i = 0; i < features.count(); ++i) ++begin_[cellOf(i) + 1];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    std::vector<std::size_t> next = begin_;
    entries_.resize(features.u.size());
    for (int i = 0; i < features.count(); ++i) entries_[next[cellOf(i)]++] = {features.u[i], features.v[i], i};
  }

  /// Writes the indices to the front of `found`, which has room for those of all features; returns their number.
  std::size_t findAround(float u, float v, std::vector<int>& found) const {
    std::size_t count = 0;
    const int first = columns_.at(u - radius_), last = columns_.at(u + radius_), last_row = rows_.at(v + radius_);
    const float square = radius_ * radius_;
    for (int row = rows_.at(v - radius_); row <= last_row; ++row) {
      const Entry* const end = entries_.data() + begin_[cell(last, row) + 1];
      for (const Entry* entry = entries_.data() + begin_[cell(first, row)]; entry < end; ++entry) {
        const float du = entry->u - u, dv = entry->v - v;
        // Written in any case, and counted if near: without a branch, which the processor could not predict.
        found[count] = entry->feature;
        count += du * du + dv * dv <= square ? 1 : 0;
      }
    }
    return count;
  }

 private:
  struct Entry {
    float u, v;
    int feature;
  };

  /// The cells along one axis. Positions beside them belong to the nearest cell.
  class Axis {
   public:
    Axis(const std::vector<float>& positions, double smallest_cell) {
      constexpr double kMostCells = 256.0;
      const auto [low, high] = std::minmax_element(positions.begin(), positions.end());
      const double extent = static_cast<double>(*high) - *low;
      const double cell = std::max(smallest_cell, extent / kMostCells);
      inverse_cell_ = 1.0 / cell;
      origin_ = cell * std::floor(*low / cell);
      last_ = std::floor((*high - origin_) * inverse_cell_);
    }
    int count() const { return static_cast<int>(last_) + 1; }
    int at(double position) const {
      return static_cast<int>(std::min(last_, std::max(0.0, (position - origin_) * inverse_cell_)));
    }

   private:
    double inverse_cell_, origin_, last_;
  };

  std::size_t cell(int column, int row) const { return static_cast<std::size_t>(row) * columns_.count() + column; }

  float radius_;
  Axis columns_, rows_;
  std::vector<Entry> entries_;      ///< cell after cell, row by row
  std::vector<std::size_t> begin_;  ///< where each cell's entries begin, and the end
};

}  // namespace

std::vector<FeatureMatch> FeatureMatcher::match(const DescribedPoints& reference, const StereoFeatures& current,
                                                const std::optional<Eigen::Isometry3d>& T_current_reference) const {
  if (reference.count() == 0 || current.count() == 0) return {};
  const DescriptorKind kind = current.kind();
  if (kind != reference.kind)
    throw std::invalid_argument("descriptors cannot be compared: " + toString(reference.kind) + " against " +
                                toString(kind));

  std::optional<PositionGrid> grid;
  if (T_current_reference) grid.emplace(current, options_.gate_radius);

  std::vector<Nearest> of_reference(reference.count()), of_current(current.count());
  std::vector<int> all(static_cast<std::size_t>(current.count()));
  std::iota(all.begin(), all.end(), 0);
  std::vector<int> candidates = all;
  std::size_t count = candidates.size();
  std::vector<float> distances(count);
  for (int i = 0; i < reference.count(); ++i) {
    if (grid) {
      const Eigen::Vector3d point = *T_current_reference * reference.positions[i];
      if (point.z() < current.camera.nearestDepth()) continue;
      const Eigen::Vector3d predicted = current.camera.project(point);
      count = grid->findAround(static_cast<float>(predicted.x()), static_cast<float>(predicted.y()), candidates);
    } else if (kind.element_type == ElementType::kBits) {
      count = findAlike(reference.descriptors.ptr(i), current.descriptors, options_.max_distance, all, distances,
                        candidates);
    }
    computeDistances(kind.element_type, reference.descriptors.ptr(i), current.descriptors, candidates.data(), count,
                     distances.data());
    Nearest nearest;  // of the candidates
    for (std::size_t k = 0; k < count; ++k) {
      nearest.note(distances[k], static_cast<int>(k));
      of_current[candidates[k]].note(distances[k], i);
    }
    if (nearest.found()) of_reference[i].note(nearest.distance(), candidates[nearest.index()]);
  }

  std::vector<FeatureMatch> matches;
  matches.reserve(of_reference.size());
  for (int i = 0; i < reference.count(); ++i) {
    if (!of_reference[i].found()) continue;
    const int j = of_reference[i].index();
    if (of_current[j].index() != i) continue;
    const float share =
        of_reference[i].distance() / distanceUnit(kind.element_type, reference.descriptors, i, current.descriptors, j);
    if (share <= options_.max_distance) matches.push_back({i, j, share});
  }
  return matches;
}

}  // namespace sdvo
