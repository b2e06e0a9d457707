#include "mosaic_check.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "../common/text.hpp"

namespace sdvo {
namespace {

constexpr int kBlock = 8;             // px: rectification shifts the pattern's phase over larger ones
constexpr double kMosaicShare = 0.2;  // chosen; real grey images have 0.013 at most, mosaics 0.9, rectified ones 0.4

/// Amplitudes of a block, grey levels: the chequered pattern of two pixels, and the next coarser ones beside it.
struct Amplitudes {
  double mean = 0.0, chequered = 0.0, coarser = 0.0;
};

Amplitudes amplitudesOf(const cv::Mat& image, cv::Point corner) {
  static const double kCosine[] = {1.0, -M_SQRT1_2, 0.0, M_SQRT1_2, -1.0, M_SQRT1_2, 0.0, -M_SQRT1_2},
                      kSine[] = {0.0, M_SQRT1_2, -1.0, M_SQRT1_2, 0.0, -M_SQRT1_2, 1.0, -M_SQRT1_2};
  Amplitudes block;
  double falling[2] = {}, rising[2] = {};  // frequencies of 3/8 in both directions, cosine and sine
  for (int y = 0; y < kBlock; ++y) {
    const auto* row = image.ptr<std::uint8_t>(corner.y + y) + corner.x;
    for (int x = 0; x < kBlock; ++x) {
      const double value = row[x];
      const int sum = (x + y) % kBlock, difference = (x - y + kBlock) % kBlock;
      block.mean += value;
      block.chequered += sum % 2 == 0 ? value : -value;
      falling[0] += value * kCosine[sum];
      falling[1] += value * kSine[sum];
      rising[0] += value * kCosine[difference];
      rising[1] += value * kSine[difference];
    }
  }
  constexpr double kPixels = kBlock * kBlock;
  block.mean /= kPixels;
  block.chequered = std::abs(block.chequered) / kPixels;
  block.coarser = std::max(std::hypot(falling[0], falling[1]), std::hypot(rising[0], rising[1])) / kPixels;
  return block;
}

}  // namespace

double mosaicShare(const cv::Mat& image) {
  constexpr double kContrast = 0.015, kAbove = 2.0;  // chosen: of the brightness; of the coarser ones
  constexpr double kDark = 10.0, kWhite = 245.0;     // grey levels: the pattern is lost in noise or clipped
  constexpr int kRows = 20;                          // of blocks: some hundreds of them
  const int step = std::max(kBlock, image.rows / kRows);
  int all = 0, chequered = 0;
  for (int y = 0; y + kBlock <= image.rows; y += step)
    for (int x = 0; x + kBlock <= image.cols; x += step) {
      const Amplitudes block = amplitudesOf(image, {x, y});
      if (block.mean < kDark || block.mean > kWhite) continue;
      ++all;
      chequered += block.chequered > kContrast * block.mean && block.chequered > kAbove * block.coarser;
    }
  constexpr int kFewest = 20;
  return all < kFewest ? 0.0 : static_cast<double>(chequered) / all;
}

cv::Mat withoutMosaic(const cv::Mat& image) {
  cv::Mat smooth;
  cv::GaussianBlur(image, smooth, {3, 3}, 0);  // weights of 1/4, 1/2 and 1/4
  return smooth;
}

std::array<cv::Mat, 2> MosaicCheck::add(const cv::Mat& left, const cv::Mat& right) {
  constexpr int kEach = 10;  // pairs: it does not change
  if (pairs_++ % kEach == 0) {
    left_ = mosaicShare(left);
    right_ = mosaicShare(right);
  }
  return {left_ > kMosaicShare ? withoutMosaic(left) : left, right_ > kMosaicShare ? withoutMosaic(right) : right};
}

std::string MosaicCheck::problem() const {
  const bool is_left = left_ > kMosaicShare, is_right = right_ > kMosaicShare;
  if (!is_left && !is_right) return "";
  const std::string which = is_left && is_right ? "both images are"
                            : is_left           ? "the left image is"
                                                : "the right image is";
  return which +
         " a colour sensor's Bayer mosaic (a period of two pixels) under the name of a grey image, and smoothed, which "
         "costs sharpness: let the driver name it (bayer_rggb8, …) and start stereo_raw.launch, which converts it";
}

Finding MosaicCheck::judge() const {
  if (pairs_ == 0) return {Verdict::kOpen, "no pairs"};
  const std::string what = text(0, 100.0 * left_, " % of the left image have a pattern of two pixels, ", 100.0 * right_,
                                " % of the right one");
  return failIf(!problem().empty(), what, problem());
}

}  // namespace sdvo
