#include "coarse_view.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace sdvo {

CoarseView::CoarseView(const cv::Mat& image) {
  constexpr double kColumns = 106.0;  // half of the smallest common width, 212
  cv::Mat small;
  const int factor = std::max(1, cvRound(image.cols / kColumns));  // an integer takes a third of the time
  const cv::Size size(image.cols / factor, image.rows / factor);
  cv::resize(image({0, 0, size.width * factor, size.height * factor}), small, size, 0.0, 0.0, cv::INTER_AREA);
  small.convertTo(view_, CV_64F);
}

std::optional<cv::Point2d> CoarseView::motionSince(const CoarseView& before, const cv::Rect& part) const {
  // Ratio of the spectrum's energy at the peak, below which views count as unrelated. Chosen between unrelated views of
  // noise (95 % below 0.27, blurred by up to 5 px) and successive images of KITTI, Karlsruhe and EuRoC (from 0.37).
  constexpr double kRelated = 0.28;
  cv::Mat window;
  cv::createHanningWindow(window, part.size(), CV_64F);
  double response = 0.0;
  const cv::Point2d motion = cv::phaseCorrelate(before.view_(part), view_(part), window, &response);
  if (!(response > kRelated)) return std::nullopt;
  return motion * (1.0 / view_.cols);
}

}  // namespace sdvo
