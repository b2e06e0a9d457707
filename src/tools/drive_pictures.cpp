#include "drive_pictures.hpp"

#include "../common/text.hpp"
#include "../messages/feature_conversions.hpp"
#include "../messages/odometry_conversions.hpp"
#include "../ros/features_image.hpp"

namespace sdvo {

cv::Mat drawLeft(const RecordedPair& pair, const StereoFeatures& features, const OdometryResult& result) {
  const cv::Mat both = drawFeatures(pair.left, pair.right, ros_conversions::toMessage(features, DepthScaleOptions()),
                                    ros_conversions::toFlow(result, features), toString(result.state));
  return both.rowRange(0, pair.left.rows);
}

void DrivePictures::add(const RecordedPair& pair, const StereoFeatures& features, const OdometryResult& result) {
  if (seen_ == 0) first_stamp_ = pair.stamp;
  const bool is_tracking = result.state == TrackingState::kTracking;
  const bool is_end = was_tracking_ && !is_tracking && ends_ < kEnds;
  // The first pair has no flow yet.
  const bool is_due = spread_ < kSpread && seen_ >= (2 * spread_ + 1) * pairs_ / (2 * kSpread);
  if (is_end || is_due) {
    const double seconds = 1e-9 * static_cast<double>(pair.stamp - first_stamp_);
    pictures_.push_back(
        {drawLeft(pair, features, result).clone(),
         text(1, seconds, " s, ", toString(result.state), result.reason.empty() ? "" : ": ", result.reason)});
  }
  if (is_end) ++ends_;
  if (is_due) ++spread_;
  was_tracking_ = is_tracking;
  ++seen_;
}

}  // namespace sdvo
