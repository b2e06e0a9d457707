#include <nodelet/nodelet.h>
#include <ros/ros.h>
#include <std_msgs/Float32.h>
#include <stereo_descriptor_vo/StereoFeatures.h>

#include <boost/make_shared.hpp>
#include <memory>
#include <opencv2/features2d.hpp>
#include <pluginlib/class_list_macros.hpp>
#include <stereo_descriptor_vo/messages/stereo_features_view.hpp>

namespace examples {

using Features = stereo_descriptor_vo::StereoFeatures;

/// Subscribes to descriptors and publishes for each pair which share of its features was there in the pair before:
/// ~match_share, std_msgs/Float32, 0 … 1. In the manager of the odometry it reads the very memory that the descriptors
/// were written to.
class DescriptorCounterNodelet : public nodelet::Nodelet {
 private:
  /// A message and the checked view of it; the view refers to the message, so they stay together.
  struct Set {
    explicit Set(const Features::ConstPtr& m) : message(m), view(*m) {}
    const Features::ConstPtr message;
    const sdvo::StereoFeaturesView view;
  };

  void onInit() override {
    publisher_ = getPrivateNodeHandle().advertise<std_msgs::Float32>("match_share", 10);
    subscriber_ = getNodeHandle().subscribe("stereo_features", 10, &DescriptorCounterNodelet::receive, this);
  }

  void receive(const Features::ConstPtr& message) try {
    auto current = std::make_unique<Set>(message);
    if (previous_ && continues(*previous_->message, *message)) {
      const auto share = boost::make_shared<std_msgs::Float32>();
      share->data = matchShare(*previous_, *current);
      publisher_.publish(share);
    }
    previous_ = std::move(current);
  } catch (const std::exception& e) {  // a malformed message; the manager must not die of it
    NODELET_ERROR_STREAM_THROTTLE(5.0, e.what());
  }

  /// Rows can be compared when they are made alike; another stream epoch is another camera, clock or kind of rows.
  static bool continues(const Features& previous, const Features& current) {
    return previous.stream_epoch == current.stream_epoch && previous.descriptor == current.descriptor &&
           previous.layout == current.layout && previous.bytes_per_row == current.bytes_per_row;
  }

  static float matchShare(const Set& previous, const Set& current) {
    if (previous.view.count() == 0 || current.view.count() == 0) return 0.f;
    const bool bits = current.message->element_type == "bits";
    const cv::Mat before = previous.view.descriptors(), now = current.view.descriptors();
    constexpr bool kMutual = true;
    std::vector<cv::DMatch> matches;
    cv::BFMatcher(bits ? cv::NORM_HAMMING : cv::NORM_L2, kMutual).match(now, before, matches);

    // Mutual is not enough: about half of all rows at random are each other's nearest.
    int alike = 0;
    for (const cv::DMatch& match : matches) {
      const double distance = bits ? match.distance / (8.0 * now.cols)
                                   : match.distance * match.distance /
                                         (now.row(match.queryIdx).dot(now.row(match.queryIdx)) +
                                          before.row(match.trainIdx).dot(before.row(match.trainIdx)) + 1e-9);
      if (distance < kMaxDistance) ++alike;
    }
    return static_cast<float>(alike) / static_cast<float>(current.view.count());
  }

  /// Of rows of one surface: share of differing bits, or |a - b|^2 / (|a|^2 + |b|^2). Unrelated rows are near 0.5.
  static constexpr double kMaxDistance = 0.3;

  std::unique_ptr<Set> previous_;
  ros::Publisher publisher_;
  ros::Subscriber subscriber_;  // destroyed first: a message may still be arriving
};

}  // namespace examples

PLUGINLIB_EXPORT_CLASS(examples::DescriptorCounterNodelet, nodelet::Nodelet)
