#include <gtest/gtest.h>
#include <ros/ros.h>

#include "../../src/ros/synchronisation/image_subscriber.hpp"

namespace sdvo::rostest_image_transport {

TEST(StereoImageTransport, EachSideKeepsItsOptionsInANamespaceOfItsOwn) {
  ros::NodeHandle nh("/image_transport_test");
  nh.setParam("image_transport", "raw");
  const StereoImageTransport transport(nh);
  EXPECT_EQ(transport.left.hints.getTransport(), "raw");
  EXPECT_EQ(transport.right.hints.getTransport(), "raw");
  EXPECT_EQ(transport.left.hints.getParameterNH().getNamespace(), "/image_transport_test/left_image");
  EXPECT_EQ(transport.right.hints.getParameterNH().getNamespace(), "/image_transport_test/right_image");
  EXPECT_NE(transport.left.plugin.get(), transport.right.plugin.get());
}

TEST(StereoImageTransport, AnUnknownOneIsRefused) {
  ros::NodeHandle nh("/unknown_transport_test");
  nh.setParam("image_transport", "pigeon");
  EXPECT_THROW(StereoImageTransport{nh}, pluginlib::PluginlibException);
}

}  // namespace sdvo::rostest_image_transport
