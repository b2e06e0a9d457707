#pragma once

#include <stereo_descriptor_vo/FeatureFlow.h>
#include <stereo_descriptor_vo/StereoFeatures.h>

#include <opencv2/core.hpp>
#include <string>

namespace sdvo {

/// A picture of the features: the left view above the right one. Around each feature is a circle of its size, red for
/// near and blue for far ones. Lines in the left view begin at a match's previous position (green: inlier, magenta:
/// outlier). `state` of the odometry is written over the left view. Images are CV_8UC1 of one size; the result is BGR.
cv::Mat drawFeatures(const cv::Mat& left, const cv::Mat& right, const stereo_descriptor_vo::StereoFeatures& features,
                     const stereo_descriptor_vo::FeatureFlow& flow, const std::string& state);

}  // namespace sdvo
