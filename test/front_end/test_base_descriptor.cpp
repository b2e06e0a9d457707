#include <gtest/gtest.h>

#include <opencv2/features2d.hpp>

#include "../../src/front_end/base_descriptor.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_base_descriptor {

/// The descriptors that the OpenCV at hand has.
std::vector<std::string> availableDescriptors() {
  std::vector<std::string> available;
  for (const std::string& name : namesOf(DescriptorType{})) {
    try {
      makeBaseDescriptor(valueOf<DescriptorType>(name));
      available.push_back(name);
    } catch (const std::invalid_argument&) {
    }
  }
  return available;
}

double rowDistance(ElementType type, const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, type == ElementType::kBits ? cv::NORM_HAMMING : cv::NORM_L2);
}

/// A textured wall seen from 8 m and from 4 m: the same points, their neighbourhoods twice as large in the second view.
class TwoDistances {
 public:
  static constexpr float kSize = 8.f;  // px, in the far view

  TwoDistances() {
    // At least 5 px for the shortest wave of the far view: the near one shows nothing that the far one does not.
    const synthetic::Texture texture(5, 0.1, 1.6);
    far_ = synthetic::renderPlane(texture, camera_, 8.0);
    near_ = synthetic::renderPlane(texture, camera_, 4.0);
    for (int row = -2; row <= 2; ++row)
      for (int column = -3; column <= 3; ++column) points_.emplace_back(0.27 * column + 0.013, 0.21 * row - 0.007);
  }

  /// Mean distance of the descriptors when those of the near view are described at `ratio` times the far view's size.
  double meanDistance(const BaseDescriptor& descriptor, double ratio) const {
    const ViewDescriptors a = descriptor.describe(far_, keypoints(8.0, kSize));
    const ViewDescriptors b = descriptor.describe(near_, keypoints(4.0, static_cast<float>(kSize * ratio)));
    double sum = 0.0;
    for (int i = 0; i < a.rows.rows; ++i) {
      EXPECT_TRUE(a.valid[static_cast<std::size_t>(i)] && b.valid[static_cast<std::size_t>(i)]) << "key point " << i;
      sum += rowDistance(descriptor.elementType(), a.rows.row(i), b.rows.row(i));
    }
    return sum / a.rows.rows;
  }

 private:
  std::vector<ViewKeypoint> keypoints(double depth, float size) const {
    std::vector<ViewKeypoint> seen;
    for (const cv::Point2d& p : points_)
      seen.push_back({static_cast<float>(camera_.fx * p.x / depth + camera_.cx),
                      static_cast<float>(camera_.fy * p.y / depth + camera_.cy), size, -1.f});
    return seen;
  }

  const StereoCamera camera_{400.0, 400.0, 322.5, 236.25, 0.5, 640, 480};
  cv::Mat far_, near_;
  std::vector<cv::Point2d> points_;  // m, on the wall
};

const TwoDistances& twoDistances() {
  static const TwoDistances scene;
  return scene;
}

class EveryDescriptor : public testing::TestWithParam<std::string> {
 protected:
  const std::unique_ptr<const BaseDescriptor> descriptor = makeBaseDescriptor(valueOf<DescriptorType>(GetParam()));
};

TEST_P(EveryDescriptor, SeesTheSameWhenTheSizeFollowsTheDistance) {
  const double following = twoDistances().meanDistance(*descriptor, 2.0);
  const double same_size = twoDistances().meanDistance(*descriptor, 1.0);
  EXPECT_LT(following, 0.6 * same_size);
  EXPECT_LT(following, 0.6 * twoDistances().meanDistance(*descriptor, 3.0));
}

TEST_P(EveryDescriptor, KeepsRowsAlignedWhereOthersLeaveTheImage) {
  const synthetic::Texture texture(7, 6.0, 60.0);
  const cv::Mat image = synthetic::render({420, 300}, texture);
  // Large and small, in and out of the image, in an order that sorting by octave or by validity would disturb.
  std::vector<ViewKeypoint> keypoints;
  std::mt19937 random(3);
  for (int i = 0; i < 40; ++i) {
    const float size = i % 3 == 0 ? 20.f : (i % 3 == 1 ? 7.f : 11.f);
    const float u = static_cast<float>(random() % 4200) / 10.f, v = static_cast<float>(random() % 3000) / 10.f;
    keypoints.push_back({u, v, size, -1.f});
  }
  const ViewDescriptors all = descriptor->describe(image, keypoints);
  ASSERT_EQ(all.rows.rows, 40);
  ASSERT_EQ(all.rows.cols, descriptor->bytes());
  const long described = std::count(all.valid.begin(), all.valid.end(), 1);
  EXPECT_GT(described, 5);
  EXPECT_LT(described, 40);
  for (int i = 0; i < 40; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const ViewDescriptors alone = descriptor->describe(image, {keypoints[k]});
    ASSERT_EQ(alone.valid[0], all.valid[k]) << "key point " << i;
    if (all.valid[k]) {
      EXPECT_TRUE(synthetic::equalMats(alone.rows, all.rows.row(i))) << "key point " << i;
    }
  }
}

TEST_P(EveryDescriptor, ReachesAsFarAsItSays) {
  const cv::Mat image = cv::Mat::zeros(200, 300, CV_8U);
  const float size = 11.f, near = static_cast<float>(descriptor->reach(size)) - 0.5f, right = 299.f - near,
              bottom = 199.f - near;
  constexpr float kLittle = 0.01f;  // px
  const auto valid = [&](float u, float v) { return descriptor->describe(image, {{u, v, size, -1.f}}).valid[0] == 1; };
  EXPECT_TRUE(valid(near + kLittle, 100.f) && valid(right - kLittle, 100.f));
  EXPECT_TRUE(valid(150.f, near + kLittle) && valid(150.f, bottom - kLittle));
  EXPECT_FALSE(valid(near - kLittle, 100.f) || valid(right + kLittle, 100.f));
  EXPECT_FALSE(valid(150.f, near - kLittle) || valid(150.f, bottom + kLittle));
}

TEST_P(EveryDescriptor, TakesNoKeypoints) {
  const cv::Mat image = cv::Mat::zeros(100, 100, CV_8U);
  EXPECT_EQ(descriptor->describe(image, {}).rows.rows, 0);
  const ViewDescriptors outside = descriptor->describe(image, {{-5.f, 50.f, 7.f, -1.f}, {50.f, 104.f, 7.f, -1.f}});
  EXPECT_EQ(outside.valid, std::vector<std::uint8_t>(2, 0));
}

INSTANTIATE_TEST_SUITE_P(Available, EveryDescriptor, testing::ValuesIn(availableDescriptors()),
                         [](const auto& parameter) { return parameter.param; });

TEST(BaseDescriptor, WhatOpenCvLacksIsOneClearError) {
  const std::vector<std::string> available = availableDescriptors();
  for (const char* always : {"freak", "brief", "orb", "brisk"})
    EXPECT_EQ(std::count(available.begin(), available.end(), always), 1) << always;
  for (const std::string& name : namesOf(DescriptorType{})) {
    if (std::count(available.begin(), available.end(), name)) continue;
    const std::string error = errorOf([&] { makeBaseDescriptor(valueOf<DescriptorType>(name)); });
    expectWords(error, {"'" + name + "'", "OpenCV"});
    EXPECT_FALSE(contains(error, "\n")) << error;
    if (name == "surf") expectWords(error, {"xfeatures2d", "OPENCV_ENABLE_NONFREE"});
  }
}

#if CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 4)
/// Ground truth is SIFT itself: the key points it finds know the octave and layer they were found in, which is what a
/// diameter has to be turned back into.
TEST(SiftDescriptor, SamplesTheOctaveAndLayerOfTheSizeAndItsRowsAreWholeNumbers) {
  const synthetic::Texture texture(11, 6.0, 120.0);
  const cv::Mat image = synthetic::render({640, 480}, texture);
  const cv::Ptr<cv::SIFT> sift = cv::SIFT::create();
  std::vector<cv::KeyPoint> detected, kept;
  sift->detect(image, detected);
  std::vector<ViewKeypoint> keypoints;
  int octaves[8] = {};
  for (cv::KeyPoint& k : detected) {
    const float margin = 3.5f * k.size;
    if (k.pt.x < margin || k.pt.y < margin || k.pt.x > 639.f - margin || k.pt.y > 479.f - margin) continue;
    k.angle = 0.f;
    kept.push_back(k);
    keypoints.push_back({k.pt.x, k.pt.y, k.size, -1.f});
    ++octaves[((k.octave + 1) & 255) % 8];
  }
  ASSERT_GT(keypoints.size(), 100u);
  for (const int octave : {0, 1, 2}) EXPECT_GT(octaves[octave], 5) << "too few key points of octave " << octave - 1;

  cv::Mat expected;
  sift->compute(image, kept, expected);
  ASSERT_EQ(expected.type(), CV_32F);
  ASSERT_EQ(expected.rows, static_cast<int>(keypoints.size()));
  const auto descriptor = makeBaseDescriptor(DescriptorType::kSift);
  ASSERT_EQ(descriptor->elementType(), ElementType::kUint8);
  ASSERT_EQ(descriptor->bytes(), 128);
  const ViewDescriptors described = descriptor->describe(image, keypoints);
  cv::Mat as_floats;
  described.rows.convertTo(as_floats, CV_32F);
  for (int i = 0; i < expected.rows; ++i) {
    ASSERT_TRUE(described.valid[static_cast<std::size_t>(i)]);
    EXPECT_EQ(cv::norm(as_floats.row(i), expected.row(i), cv::NORM_INF), 0.0)
        << "size " << kept[static_cast<std::size_t>(i)].size << " octave "
        << (kept[static_cast<std::size_t>(i)].octave & 255);
  }
}

#endif

}  // namespace sdvo::test_base_descriptor
