#include "epipolar_search.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "../common/kernel.hpp"
#include "block_differences.hpp"
#include "image_copies.hpp"
#include "slanted_patch.hpp"

namespace sdvo {
namespace {

constexpr int kHalfRows = 4;  // block rows above and below the centre, at half resolution (chosen)
constexpr int kFullRows = 5;  // the same at full resolution (chosen)
constexpr int kSame = 2;      // px at half resolution (chosen): blocks so near the best one are the same place

constexpr int kMargin = SearchedImages::kMargin;

/// The least of the values from `begin` to before `end`.
struct Least {
  static SDVO_IN_KERNEL void run(const unsigned* values, int begin, int end, unsigned* least) {
    unsigned smallest = std::numeric_limits<unsigned>::max();
    for (int k = begin; k < end; ++k) smallest = std::min(smallest, values[k]);
    *least = smallest;
  }
};

/// Twice the least that the sums of absolute differences in `values` can reach between pixels, where they have a
/// minimum, from `begin` to before `end`; the largest number elsewhere. Model: as valleyBetween(). Two neighbours more
/// are read.
struct ValleyBottoms {
  static SDVO_IN_KERNEL void run(const unsigned* values, int begin, int end, unsigned* bottoms) {
    for (int k = begin; k < end; ++k) {
      const int before = static_cast<int>(values[k - 1]), after = static_cast<int>(values[k + 1]);
      const int here = static_cast<int>(values[k]), bottom = std::max(2 * here - std::abs(before - after), 0);
      bottoms[k] =
          here <= std::min(before, after) ? static_cast<unsigned>(bottom) : std::numeric_limits<unsigned>::max();
    }
  }
};

unsigned leastOf(const unsigned* values, int begin, int end) {
  unsigned least;
  runKernel<Least>(values, begin, end, &least);
  return least;
}

/// The lowest of the valleys of some sums that is further than `kSame` from `centre`.
struct LowestValley {
  unsigned twice_bottom;
  int at;
};
LowestValley lowestValley(const std::vector<unsigned>& values, int centre) {
  const int count = static_cast<int>(values.size());
  thread_local std::vector<unsigned> bottoms;
  bottoms.assign(values.size(), std::numeric_limits<unsigned>::max());
  runKernel<ValleyBottoms>(values.data(), 1, count - 1, bottoms.data());
  const int begin = std::max(centre - kSame, 0), end = std::min(centre + kSame + 1, count);
  if (begin < end) std::fill(bottoms.begin() + begin, bottoms.begin() + end, std::numeric_limits<unsigned>::max());
  const unsigned least = leastOf(bottoms.data(), 0, count);
  return {least, static_cast<int>(std::find(bottoms.begin(), bottoms.end(), least) - bottoms.begin())};
}

/// Sub-pixel offset of the minimum from the middle one of three sums of absolute differences, which is the least.
/// Model: the sums rise to both sides at the same rate.
float valleyBetween(const unsigned* differences) {
  const float before = static_cast<float>(differences[0]), after = static_cast<float>(differences[2]);
  const float rise = std::max(before, after) - static_cast<float>(differences[1]);
  return rise > 0.f ? 0.5f * (before - after) / rise : 0.f;
}

/// Eigen sums three products in an order that depends on the processor: here it is written down.
float sumOfProducts(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return a[0] * b[0] + (a[1] * b[1] + a[2] * b[2]);
}

Eigen::Matrix3f inverseOfSymmetric(const Eigen::Matrix3f& m) {
  const Eigen::Vector3f first(m(1, 1) * m(2, 2) - m(1, 2) * m(1, 2), m(1, 2) * m(0, 2) - m(2, 2) * m(0, 1),
                              m(0, 1) * m(1, 2) - m(0, 2) * m(1, 1));
  const float factor = 1.f / sumOfProducts(first, m.col(0));
  const float a = first[0] * factor, b = first[1] * factor, c = first[2] * factor;
  const float d = (m(2, 2) * m(0, 0) - m(0, 2) * m(0, 2)) * factor,
              e = (m(0, 2) * m(0, 1) - m(0, 0) * m(1, 2)) * factor;
  const float f = (m(0, 0) * m(1, 1) - m(0, 1) * m(0, 1)) * factor;
  return (Eigen::Matrix3f() << a, b, c, b, d, e, c, e, f).finished();
}

}  // namespace

void SearchedImages::take(const cv::Mat& new_left, const cv::Mat& new_right) {
  addMargin(new_left, kMargin, left);
  addMargin(new_right, kMargin, right);
  halveImage(new_left, half);
  addMargin(half, kMargin, left_half);
  halveImage(new_right, half);
  addMargin(half, kMargin, right_half);
}

std::optional<EpipolarSearch::Found> EpipolarSearch::find(const cv::Point2f& left_position) const {
  const std::optional<RowMatch> match = searchRow(left_position);
  if (!match) return std::nullopt;
  const std::optional<cv::Point2f> place = refine(images_.right, left_position, match->disparity);
  if (!place) return std::nullopt;
  return Found{*place, static_cast<float>(match->rival)};
}

float EpipolarSearch::findPeriod(const cv::Point2f& left_position, double disparity) const {
  const int x = cvRound(0.5f * left_position.x - 0.25f), y = cvRound(0.5f * left_position.y - 0.25f);
  const std::uint8_t* block = images_.left_half.ptr(y + kMargin) + x + kMargin;
  const int most = static_cast<int>(0.5 * std::max(max_disparity_ - disparity, disparity));
  const int columns = images_.left_half.cols - 2 * kMargin, to_right = std::min(most, columns - 1 - x);
  const int count = to_right + std::min(most, x) + 1;
  if (count < 3) return 0.f;
  thread_local std::vector<unsigned> differences;
  differences.resize(static_cast<std::size_t>(count));
  blockDifferences<kHalfRows>(block, block + to_right, static_cast<std::ptrdiff_t>(images_.left_half.step[0]), count,
                              differences.data());
  // Without a valley, this is the end of the range: refine() finds a period there, or nothing.
  const int shift = 2 * (lowestValley(differences, to_right).at - to_right);
  const std::optional<cv::Point2f> place = refine(images_.left, left_position, shift);
  return place && std::abs(place->y) <= options_.max_epipolar_residual ? std::abs(place->x) : 0.f;
}

std::optional<EpipolarSearch::RowMatch> EpipolarSearch::searchRow(const cv::Point2f& left_position) const {
  // The centre of half-resolution pixel h lies between full pixels 2 h and 2 h + 1.
  const int x = cvRound(0.5f * left_position.x - 0.25f), y = cvRound(0.5f * left_position.y - 0.25f);
  const std::uint8_t* left = images_.left_half.ptr(y + kMargin) + x + kMargin;
  const std::uint8_t* right = images_.right_half.ptr(y + kMargin) + x + kMargin;
  // A corner that matches best at a negative disparity has no match. In swapped images these are most corners.
  constexpr int kNegative = 16;
  const int range = std::min(static_cast<int>(0.5 * max_disparity_), x);
  const int count = kNegative + range + 1;
  thread_local std::vector<unsigned> differences;
  differences.resize(static_cast<std::size_t>(count));
  const std::ptrdiff_t step = static_cast<std::ptrdiff_t>(images_.left_half.step[0]);
  blockDifferences<kHalfRows>(left, right + kNegative, step, count, differences.data());
  const unsigned least = leastOf(differences.data(), 0, count);
  const int best = static_cast<int>(std::find(differences.begin(), differences.end(), least) - differences.begin());
  if (best < kNegative - 1) return std::nullopt;
  const unsigned elsewhere =
      std::min(leastOf(differences.data(), 0, best - kSame), leastOf(differences.data(), best + kSame + 1, count));
  if (least > options_.epipolar.uniqueness * elsewhere) return std::nullopt;
  // The sums of equal blocks differ by where they lie between pixels, up to this ratio (chosen): the best one may be
  // a period off.
  constexpr unsigned kRival = 2;
  const LowestValley valley = lowestValley(differences, best);
  return RowMatch{2 * (best - kNegative),
                  2 * kRival * least > valley.twice_bottom ? 2 * std::abs(valley.at - best) : 0};
}

std::optional<cv::Point2f> EpipolarSearch::refine(const cv::Mat& other, const cv::Point2f& left_position,
                                                  int disparity) const {
  const cv::Point left(cvRound(left_position.x), cvRound(left_position.y));
  return align(other, left_position, searchAround(other, left, disparity));
}

cv::Point2f EpipolarSearch::searchAround(const cv::Mat& other, const cv::Point& left, int disparity) const {
  constexpr int kReach = 2;
  const int rows = std::min(2, static_cast<int>(std::ceil(options_.max_epipolar_residual)));
  const std::uint8_t* block = images_.left.ptr(left.y + kMargin) + left.x + kMargin;
  const std::ptrdiff_t step = static_cast<std::ptrdiff_t>(images_.left.step[0]);
  cv::Point2f best;
  unsigned least = std::numeric_limits<unsigned>::max();
  for (int dv = -rows; dv <= rows; ++dv) {
    const std::uint8_t* around = other.ptr(left.y + dv + kMargin) + left.x - disparity + kReach + kMargin;
    unsigned differences[2 * kReach + 1];
    blockDifferences<kFullRows>(block, around, step, 2 * kReach + 1, differences);
    for (int k = 0; k <= 2 * kReach; ++k) {
      const int d = disparity - kReach + k;
      if (left.x - d < 0 || left.x - d > other.cols - 2 * kMargin) continue;
      if (differences[k] >= least) continue;
      least = differences[k];
      const float between = k > 0 && k < 2 * kReach ? valleyBetween(differences + k - 1) : 0.f;
      best = {static_cast<float>(d) + between, static_cast<float>(dv)};
    }
  }
  return best;
}

/// Inverse compositional alignment (Baker and Matthews 2004) of (disparity, dv, slant), blind to a difference of
/// brightness. On the ground in front of a vehicle, disparities grow by a third of a pixel from row to row: without
/// the slant, the result would be half a pixel off there.
std::optional<cv::Point2f> EpipolarSearch::align(const cv::Mat& other, const cv::Point2f& left_position,
                                                 const cv::Point2f& start) const {
  constexpr int kIterations = 10;
  constexpr float kConverged = 0.03f, kNextConverged = 0.015f;  // px, of a step and of what would be the next one
  constexpr float kLargestCorrection = 2.0f;                    // px
  constexpr float kSteepest = 0.8f;                             // px per row
  // Prior of the slant, for patches that constrain it little: zero, with a standard deviation.
  constexpr float kNoise = 5.f, kUsualSlant = 0.2f;  // grey levels, px per row
  constexpr float kUpright = (kNoise / kUsualSlant) * (kNoise / kUsualSlant);
  thread_local SlantedPatch patch;
  patch.take(images_.left, kMargin, left_position.x, left_position.y);
  Eigen::Matrix3f hessian = patch.hessian();
  const float dd = hessian(0, 0), dv = hessian(0, 1), vv = hessian(1, 1);
  // Sum of squared gradients of pure noise: half a difference has half of the noise's variance, and interpolation
  // between pixels leaves 0.44 of that on average.
  const float of_noise = 0.22f * static_cast<float>(noise_ * noise_) * float{SlantedPatch::kPixels};
  if (dd * vv - dv * dv < 1e-3f * dd * vv || dd < of_noise) return std::nullopt;
  hessian(2, 2) += kUpright;
  const Eigen::Matrix3f inverse = inverseOfSymmetric(hessian);

  cv::Point2f found = start;
  float slant = 0.f, step_before = 0.f;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Eigen::Vector3f gradient =
        patch.compare(other, kMargin, left_position.x - found.x, left_position.y + found.y, slant);
    gradient[2] -= kUpright * slant;
    Eigen::Vector3f step;
    for (int i = 0; i < 3; ++i) step[i] = sumOfProducts(inverse.col(i), gradient);
    slant += step[2];
    found.x += step[0] + slant * step[1];
    found.y += step[1];
    const cv::Point2f correction = found - start;
    if (!(std::max(std::abs(correction.x), std::abs(correction.y)) <= kLargestCorrection)) return std::nullopt;
    if (!(std::abs(slant) <= kSteepest)) return std::nullopt;
    const float u_other = left_position.x - found.x;
    if (u_other < 0.f || u_other > static_cast<float>(other.cols - 2 * kMargin - 1)) return std::nullopt;
    // Convergence is linear: the next step has about the length square / previous.
    const float length = std::max(std::abs(step[0]), std::abs(step[1]));
    if (length < kConverged || length * length < kNextConverged * step_before) break;
    step_before = length;
  }

  const auto [product, square, other_square] = patch.similarity();
  if (!(other_square > 0.f)) return std::nullopt;  // nothing but one grey level
  if (product < options_.epipolar.min_correlation * std::sqrt(square) * std::sqrt(other_square)) return std::nullopt;
  return found;
}

}  // namespace sdvo
