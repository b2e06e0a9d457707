#include "block_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "../common/kernel.hpp"
#include "image_noise.hpp"

namespace sdvo {
namespace {

constexpr double kFlat = 2.0;  // sigma of the image's noise; the correlation of flat blocks means nothing

/// Sums over `count` blocks, one from each pixel of a row on: of their products with another block, and over their
/// columns of grey levels and of their squares.
struct SumBlocks {
  static SDVO_IN_KERNEL void run(const cv::Mat* block, const cv::Mat* image, int y, int count, int* products, int* sums,
                                 int* squares) {
    const int wide = count + block->cols - 1;
    std::fill(products, products + count, 0);
    std::fill(sums, sums + wide, 0);
    std::fill(squares, squares + wide, 0);
    for (int r = 0; r < block->rows; ++r) {
      const std::uint8_t* row = image->data + image->step[0] * static_cast<std::size_t>(y + r);
      const std::uint8_t* other = block->data + block->step[0] * static_cast<std::size_t>(r);
      for (int k = 0; k < wide; ++k) sums[k] += row[k], squares[k] += row[k] * row[k];
      for (int c = 0; c < block->cols; ++c)
        for (int k = 0; k < count; ++k) products[k] += other[c] * row[k + c];
    }
  }
};

/// Correlation of a block with those of its size in an image, by the position of their corner. Without the Fourier
/// transforms of cv::matchTemplate, which so small images do not repay: half of the instructions.
cv::Mat correlationOf(const cv::Mat& block, const cv::Mat& image) {
  cv::Mat correlation(image.rows - block.rows + 1, image.cols - block.cols + 1, CV_32F);
  std::vector<int> products(static_cast<std::size_t>(correlation.cols)), sums(static_cast<std::size_t>(image.cols)),
      squares(static_cast<std::size_t>(image.cols));
  const double pixels = static_cast<double>(block.total());
  const double sum = cv::sum(block)[0], square = block.dot(block), variance = pixels * square - sum * sum;
  for (int y = 0; y < correlation.rows; ++y) {
    runKernel<SumBlocks>(&block, &image, y, correlation.cols, products.data(), sums.data(), squares.data());
    int of_others = std::accumulate(sums.begin(), sums.begin() + block.cols - 1, 0);
    int of_squares = std::accumulate(squares.begin(), squares.begin() + block.cols - 1, 0);
    for (int x = 0; x < correlation.cols; ++x) {
      const std::size_t first = static_cast<std::size_t>(x), last = static_cast<std::size_t>(x + block.cols - 1);
      of_others += sums[last], of_squares += squares[last];
      const double other = of_others, other_variance = pixels * of_squares - other * other;
      const double covariance = pixels * products[first] - sum * other;
      correlation.at<float>(y, x) =
          other_variance > 0.0 ? static_cast<float>(covariance / std::sqrt(variance * other_variance)) : 0.f;
      of_others -= sums[first], of_squares -= squares[first];
    }
  }
  return correlation;
}

/// Position of the best correlation with the block around `centre`, within `area`, a rectangle of block centres.
/// Nothing unless 1 - best < uniqueness * (1 - best elsewhere): else the texture repeats, or the true match lies
/// outside of the area. Nothing either if the block's standard deviation is below `flat`.
std::optional<cv::Point> findBlock(const cv::Mat& from, const cv::Mat& in, cv::Point centre, cv::Size half,
                                   cv::Rect area, double uniqueness, double flat) {
  constexpr double kAlike = 0.85;  // least correlation
  constexpr int kSame = 2;         // px around the best that count as the same place
  const cv::Rect block(centre.x - half.width, centre.y - half.height, 2 * half.width + 1, 2 * half.height + 1);
  const cv::Rect whole(0, 0, from.cols, from.rows);
  const cv::Rect reach =
      cv::Rect(area.x - half.width, area.y - half.height, area.width + 2 * half.width, area.height + 2 * half.height) &
      whole;
  if ((block & whole) != block || reach.width < block.width || reach.height < block.height) return std::nullopt;
  cv::Scalar mean, deviation;
  cv::meanStdDev(from(block), mean, deviation);
  if (deviation[0] < flat) return std::nullopt;
  cv::Mat correlation = correlationOf(from(block), in(reach));
  double best = 0.0, elsewhere = 0.0;
  cv::Point at;
  cv::minMaxLoc(correlation, nullptr, &best, nullptr, &at);
  if (!(best >= kAlike)) return std::nullopt;
  const cv::Rect same(at.x - kSame, at.y - kSame, 2 * kSame + 1, 2 * kSame + 1);
  correlation(same & cv::Rect(0, 0, correlation.cols, correlation.rows)).setTo(-1.0);
  cv::minMaxLoc(correlation, nullptr, &elsewhere);
  if (1.0 - best >= uniqueness * (1.0 - elsewhere)) return std::nullopt;
  return cv::Point(reach.x + at.x + half.width, reach.y + at.y + half.height);
}

/// The same with a check from right to left: the match of the match must be the centre, to a pixel.
std::optional<cv::Point> findMutually(const cv::Mat& left, const cv::Mat& right, cv::Point centre, cv::Size half,
                                      cv::Size reach, double flat) {
  constexpr double kUnique = 0.7;
  const auto around = [&](cv::Point middle) {
    return cv::Rect(middle.x - reach.width, middle.y - reach.height, 2 * reach.width + 1, 2 * reach.height + 1);
  };
  const auto there = findBlock(left, right, centre, half, around(centre), kUnique, flat);
  if (!there) return std::nullopt;
  const auto back = findBlock(right, left, *there, half, around(*there), kUnique, flat);
  if (!back || std::max(std::abs(back->x - centre.x), std::abs(back->y - centre.y)) > 1) return std::nullopt;
  return there;
}

cv::Mat quarter(const cv::Mat& image) {
  cv::Mat small;
  cv::resize(image, small, cv::Size(image.cols / 4, image.rows / 4), 0.0, 0.0, cv::INTER_AREA);
  return small;
}

}  // namespace

BlockSearch::BlockSearch(const cv::Mat& left, const cv::Mat& right, double max_disparity, double reach)
    : left_(left),
      right_(right),
      small_left_(quarter(left)),
      small_right_(quarter(right)),
      flat_(kFlat * noiseOf(left)),
      reach_(static_cast<int>(std::ceil(0.25 * max_disparity)), static_cast<int>(std::ceil(0.25 * reach))) {}

std::optional<FoundCorner> BlockSearch::find(const cv::Point2f& corner) const {
  // Coarsely in all directions, swapped sides included, then around that to a pixel.
  const cv::Point small(cvRound(0.25f * corner.x - 0.375f), cvRound(0.25f * corner.y - 0.375f));
  const auto coarse = findMutually(small_left_, small_right_, small, {5, 4}, reach_, flat_);
  if (!coarse) return std::nullopt;
  const cv::Point centre(cvRound(corner.x), cvRound(corner.y));
  const cv::Point guess = centre + 4 * (*coarse - small);
  const auto fine = findBlock(left_, right_, centre, {7, 7}, {guess.x - 4, guess.y - 4, 9, 9}, 1.0, flat_);
  if (!fine) return std::nullopt;
  const auto at = [](int pixel) { return static_cast<double>(pixel); };
  return FoundCorner{at(centre.x), at(centre.y), at(centre.x - fine->x), at(fine->y - centre.y)};
}

}  // namespace sdvo
