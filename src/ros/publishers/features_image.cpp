#include "features_image.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/messages/stereo_features_view.hpp"

namespace sdvo {
namespace {

constexpr int kShift = 4;  // sub-pixel bits of OpenCV's drawing
const cv::Scalar kInlier(80, 220, 80), kOutlier(200, 60, 220);

cv::Point fixedPoint(double u, double v) {
  return {static_cast<int>(std::lround(u * (1 << kShift))), static_cast<int>(std::lround(v * (1 << kShift)))};
}

/// Far (1 px of disparity) blue to near (128 px) red, in steps of equal ratios.
cv::Scalar depthColour(float disparity) {
  static const cv::Mat palette = [] {
    cv::Mat grey(1, 256, CV_8U), colours;
    for (int i = 0; i < 256; ++i) grey.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
    cv::applyColorMap(grey, colours, cv::COLORMAP_JET);
    return colours;
  }();
  const double share = std::log2(std::clamp(disparity, 1.f, 128.f)) / 7.0;
  const auto& colour = palette.at<cv::Vec3b>(0, static_cast<int>(share * 255.0));
  return {static_cast<double>(colour[0]), static_cast<double>(colour[1]), static_cast<double>(colour[2])};
}

void drawCircle(cv::Mat& image, double u, double v, double diameter, const cv::Scalar& colour) {
  const int radius = static_cast<int>(std::lround(0.5 * diameter * (1 << kShift)));
  cv::circle(image, fixedPoint(u, v), radius, colour, 1, cv::LINE_AA, kShift);
}

/// Words in the upper left corner, of a size that is legible when a large image is shown 500 px wide, on a darkened
/// strip: an outline alone does not make them legible before white walls. As many phrases share a line as the image has
/// room for.
void drawCaption(cv::Mat& image, const std::vector<std::string>& phrases) {
  constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX, kMargin = 6;  // px
  const double scale = std::max(0.5, 0.001 * image.cols);
  const int line = static_cast<int>(36 * scale), stroke = static_cast<int>(2 * scale);
  std::vector<std::string> lines;
  for (const std::string& phrase : phrases) {
    const std::string longer = lines.empty() ? phrase : lines.back() + ", " + phrase;
    int baseline = 0;
    if (lines.empty() || cv::getTextSize(longer, kFont, scale, stroke, &baseline).width > image.cols - 2 * kMargin)
      lines.push_back(phrase);
    else
      lines.back() = longer;
  }
  constexpr double kDarkened = 0.35;  // of the grey levels (chosen)
  const int bottom = line * static_cast<int>(lines.size()) + line / 3;
  image.rowRange(0, std::min(bottom, image.rows)) *= kDarkened;
  for (std::size_t i = 0; i < lines.size(); ++i)
    cv::putText(image, lines[i], {kMargin, line * static_cast<int>(i + 1)}, kFont, scale, cv::Scalar::all(255), stroke,
                cv::LINE_AA);
}

}  // namespace

cv::Mat drawFeatures(const cv::Mat& left, const cv::Mat& right, const stereo_descriptor_vo::StereoFeatures& features,
                     const stereo_descriptor_vo::FeatureFlow& flow, const std::string& state) {
  const StereoFeaturesView view(features);
  cv::Mat left_colour, right_colour;
  cv::cvtColor(left, left_colour, cv::COLOR_GRAY2BGR);
  cv::cvtColor(right, right_colour, cv::COLOR_GRAY2BGR);

  for (int i = 0; i < view.count(); ++i) {
    const cv::Scalar colour = depthColour(features.disparity[i]);
    drawCircle(left_colour, features.u[i], features.v[i], features.size[i], colour);
    drawCircle(right_colour, features.u[i] - features.disparity[i], features.v[i] + features.dv[i], features.size[i],
               colour);
  }
  const std::size_t matches =
      std::min({flow.u.size(), flow.v.size(), flow.u_reference.size(), flow.v_reference.size(), flow.inlier.size()});
  std::size_t drawn = 0, inliers = 0;
  const auto drawable = [&](double u, double v) {
    return u >= -left.cols && u <= 2 * left.cols && v >= -left.rows && v <= 2 * left.rows;
  };
  for (std::size_t i = 0; i < matches; ++i) {
    if (!drawable(flow.u_reference[i], flow.v_reference[i]) || !drawable(flow.u[i], flow.v[i])) continue;
    ++drawn;
    inliers += flow.inlier[i] ? 1 : 0;
    cv::line(left_colour, fixedPoint(flow.u_reference[i], flow.v_reference[i]), fixedPoint(flow.u[i], flow.v[i]),
             flow.inlier[i] ? kInlier : kOutlier, 1, cv::LINE_AA, kShift);
  }
  drawCaption(left_colour,
              {state, std::to_string(view.count()) + " features", std::to_string(matches) + " matches",
               std::to_string(inliers) + " inliers (green)", std::to_string(drawn - inliers) + " outliers (magenta)"});
  drawCaption(right_colour, {"right: circles sized by depth", "near red to far blue"});
  cv::Mat both;
  cv::vconcat(left_colour, right_colour, both);
  return both;
}

}  // namespace sdvo
