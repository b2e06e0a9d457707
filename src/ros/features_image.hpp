#pragma once

#include <stereo_descriptor_vo/FeatureFlow.h>
#include <stereo_descriptor_vo/StereoFeatures.h>

#include <opencv2/core.hpp>
#include <string>

namespace sdvo {

/// What the pipeline sees, as a picture: the left view above the right one, a circle of the depth-derived size around
/// each feature in both, near ones red and far ones blue; lines in the left view lead from where a matched feature was
/// before (green: inlier, magenta: outlier). `state`: of the odometry, written over the left view. Images are CV_8UC1
/// of one size; the result is CV_8UC3, BGR.
cv::Mat drawFeatures(const cv::Mat& left, const cv::Mat& right, const stereo_descriptor_vo::StereoFeatures& features,
                     const stereo_descriptor_vo::FeatureFlow& flow, const std::string& state);

}  // namespace sdvo
