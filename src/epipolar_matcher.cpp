#include "stereo_descriptor_vo/epipolar_matcher.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace sdvo {
namespace {

// A block is one SIMD register wide.
constexpr int kBlockWidth = 16, kLeftOfBlock = 8;
constexpr int kHalfRows = 4;  // block rows above and below the centre at half resolution
constexpr int kFullRows = 5;  // … and at full resolution
constexpr int kMargin = 32;   // px added around every image, so that no read needs a check

/// Sum of absolute differences of two blocks centred at the given pixels.
inline unsigned blockDifference(const std::uint8_t* a, const std::uint8_t* b, std::size_t step, int rows) {
  unsigned sum = 0;
  for (int row = -rows; row <= rows; ++row) {
    const std::ptrdiff_t offset = row * static_cast<std::ptrdiff_t>(step) - kLeftOfBlock;
#if CV_SIMD128
    sum += cv::v_reduce_sad(cv::v_load(a + offset), cv::v_load(b + offset));
#else
    for (int k = 0; k < kBlockWidth; ++k) sum += static_cast<unsigned>(std::abs(a[offset + k] - b[offset + k]));
#endif
  }
  return sum;
}

cv::Mat withMargin(const cv::Mat& image) {
  cv::Mat larger;
  cv::copyMakeBorder(image, larger, kMargin, kMargin, kMargin, kMargin, cv::BORDER_REPLICATE);
  return larger;
}

cv::Mat halved(const cv::Mat& image) {
  cv::Mat half;
  cv::resize(image, half, cv::Size((image.cols + 1) / 2, (image.rows + 1) / 2), 0.0, 0.0, cv::INTER_AREA);
  return half;
}

/// Square of side n around a sub-pixel position of an image with a margin, interpolated bilinearly.
void samplePatch(const cv::Mat& image, float x, float y, int radius, int n, float* patch) {
  const int column = static_cast<int>(std::floor(x)), row = static_cast<int>(std::floor(y));
  const float a = x - static_cast<float>(column), b = y - static_cast<float>(row);
  const float w00 = (1 - a) * (1 - b), w01 = a * (1 - b), w10 = (1 - a) * b, w11 = a * b;
  for (int j = 0; j < n; ++j, patch += n) {
    const std::uint8_t* upper = image.ptr(row + j - radius + kMargin) + column - radius + kMargin;
    const std::uint8_t* lower = upper + image.step;
    for (int i = 0; i < n; ++i) patch[i] = w00 * upper[i] + w01 * upper[i + 1] + w10 * lower[i] + w11 * lower[i + 1];
  }
}

}  // namespace

EpipolarMatcher::EpipolarMatcher(const EpipolarMatcherOptions& options, double max_dv, const cv::Mat& left,
                                 const cv::Mat& right)
    : options_(options), max_dv_(max_dv), left_(withMargin(left)), right_(withMargin(right)) {
  left_half_ = withMargin(halved(left));
  right_half_ = withMargin(halved(right));
}

std::optional<cv::Point2f> EpipolarMatcher::find(const cv::Point2f& left_position) const {
  const std::optional<int> disparity = searchRow(left_position);
  if (!disparity) return std::nullopt;
  const cv::Point start = searchAround(cv::Point(cvRound(left_position.x), cvRound(left_position.y)), *disparity);
  return align(left_position, start);
}

std::optional<int> EpipolarMatcher::searchRow(const cv::Point2f& left_position) const {
  // The centre of half-resolution pixel h lies between full pixels 2 h and 2 h + 1.
  const int x = cvRound(0.5f * left_position.x - 0.25f), y = cvRound(0.5f * left_position.y - 0.25f);
  const std::uint8_t* left = left_half_.ptr(y + kMargin) + x + kMargin;
  const std::uint8_t* right = right_half_.ptr(y + kMargin) + x + kMargin;
  // A point that looks best at a negative disparity has no match: swapped images show themselves this way.
  constexpr int kNegative = 16;
  const int range = std::min(static_cast<int>(0.5 * options_.max_disparity), x);
  thread_local std::vector<unsigned> differences;
  differences.resize(kNegative + range + 1);
  int best = 0;
  for (int k = 0; k <= kNegative + range; ++k) {
    differences[k] = blockDifference(left, right + kNegative - k, left_half_.step, kHalfRows);
    if (differences[k] < differences[best]) best = k;
  }
  if (best < kNegative - 1) return std::nullopt;
  unsigned elsewhere = std::numeric_limits<unsigned>::max();
  for (int k = 0; k <= kNegative + range; ++k)
    if (std::abs(k - best) > 2) elsewhere = std::min(elsewhere, differences[k]);
  if (differences[best] > options_.uniqueness * elsewhere) return std::nullopt;
  return 2 * (best - kNegative);
}

cv::Point EpipolarMatcher::searchAround(const cv::Point& left, int disparity) const {
  constexpr int kReach = 2;
  const int rows = std::min(2, static_cast<int>(std::ceil(max_dv_)));
  const std::uint8_t* block = left_.ptr(left.y + kMargin) + left.x + kMargin;
  cv::Point best;
  unsigned least = std::numeric_limits<unsigned>::max();
  for (int dv = -rows; dv <= rows; ++dv)
    for (int d = disparity - kReach; d <= disparity + kReach; ++d) {
      if (left.x - d < 0 || left.x - d > right_.cols - 2 * kMargin) continue;
      const std::uint8_t* other = right_.ptr(left.y + dv + kMargin) + left.x - d + kMargin;
      const unsigned difference = blockDifference(block, other, left_.step, kFullRows);
      if (difference < least) least = difference, best = cv::Point(d, dv);
    }
  return best;
}

/// Inverse compositional alignment (Baker and Matthews 2004) of a translation, blind to a difference of brightness.
std::optional<cv::Point2f> EpipolarMatcher::align(const cv::Point2f& left_position, const cv::Point2f& start) const {
  constexpr int kIterations = 10;
  constexpr float kConverged = 0.01f, kLargestCorrection = 2.0f;  // px
  const int radius = options_.patch_radius, n = 2 * radius + 1, outer = n + 2;
  // Eigen sums in parallel lanes, which a plain loop over floats may not.
  thread_local Eigen::VectorXf wide, patch, gradient_x, gradient_y, other;
  wide.resize(outer * outer);
  for (auto* values : {&patch, &gradient_x, &gradient_y, &other}) values->resize(n * n);
  samplePatch(left_, left_position.x, left_position.y, radius + 1, outer, wide.data());
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const float* centre = wide.data() + (j + 1) * outer + i + 1;
      patch[j * n + i] = *centre;
      gradient_x[j * n + i] = 0.5f * (centre[1] - centre[-1]);
      gradient_y[j * n + i] = 0.5f * (centre[outer] - centre[-outer]);
    }
  for (auto* values : {&patch, &gradient_x, &gradient_y}) values->array() -= values->mean();
  const float xx = gradient_x.squaredNorm(), xy = gradient_x.dot(gradient_y), yy = gradient_y.squaredNorm();
  const float determinant = xx * yy - xy * xy;
  if (determinant < 1e-3f * xx * yy || xx < static_cast<float>(n * n)) return std::nullopt;
  const float bx_patch = gradient_x.dot(patch), by_patch = gradient_y.dot(patch);

  cv::Point2f found = start;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    samplePatch(right_, left_position.x - found.x, left_position.y + found.y, radius, n, other.data());
    // The gradients have no mean, so that of the other patch drops out.
    const float bx = gradient_x.dot(other) - bx_patch, by = gradient_y.dot(other) - by_patch;
    const float step_x = (yy * bx - xy * by) / determinant, step_y = (xx * by - xy * bx) / determinant;
    found.x += step_x;  // the patch moves by -step in the right image: its disparity grows
    found.y -= step_y;
    const cv::Point2f correction = found - start;
    if (!(std::max(std::abs(correction.x), std::abs(correction.y)) <= kLargestCorrection)) return std::nullopt;
    const float u_right = left_position.x - found.x;
    if (u_right < 0.f || u_right > static_cast<float>(right_.cols - 2 * kMargin - 1)) return std::nullopt;
    if (std::max(std::abs(step_x), std::abs(step_y)) < kConverged) break;
  }

  other.array() -= other.mean();
  if (patch.dot(other) < options_.min_correlation * patch.norm() * other.norm()) return std::nullopt;
  return found;
}

}  // namespace sdvo
