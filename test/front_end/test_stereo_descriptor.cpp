#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "../../src/front_end/freak.hpp"
#include "../../src/front_end/stereo_descriptor.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_stereo_descriptor {

const cv::Size kSize(320, 200);

cv::Mat view(unsigned seed) {
  const synthetic::Texture texture(seed, 5.0, 80.0);
  return synthetic::render(kSize, texture);
}

DescriptorOptions withLayout(DescriptorLayout layout, bool oriented = false) {
  DescriptorOptions options;
  options.layout = layout;
  options.oriented = oriented;
  return options;
}

/// Rows of a key point in both views, one after the other.
cv::Mat rowsOf(const Freak& left, const Freak& right, const StereoKeypoint& k, float angle = -1.f) {
  cv::Mat rows(1, 2 * Freak::kBytes, CV_8U);
  left.describe({{k.u_left, k.v_left, k.size, angle}}, {rows.ptr()});
  right.describe({{k.u_right, k.v_right, k.size, angle}}, {rows.ptr() + Freak::kBytes});
  return rows;
}

/// With a reach of 22 px: fits, leaves the left view, leaves the right view, fits, leaves it at the bottom, fits.
std::vector<StereoKeypoint> mixedKeypoints() {
  return {{100.25f, 90.f, 80.f, 90.4f, 7.f}, {310.f, 90.f, 280.f, 90.f, 7.f},   {40.f, 60.f, 10.f, 60.f, 7.f},
          {200.f, 50.f, 150.5f, 50.f, 7.f},  {200.f, 190.f, 150.f, 190.f, 7.f}, {60.f, 100.f, 50.f, 101.f, 9.6f}};
}

const std::vector<int> kFitting = {0, 3, 5};

TEST(StereoDescriptor, IsTheConcatenationOfBothViews) {
  const cv::Mat left = view(1), right = view(2);
  const std::vector<StereoKeypoint> keypoints = mixedKeypoints();
  const DescribedKeypoints both =
      StereoDescriptor(withLayout(DescriptorLayout::kLeftAndRight)).describe(left, right, keypoints);
  ASSERT_EQ(both.index, kFitting);
  ASSERT_EQ(both.rows.cols, 2 * Freak::kBytes);
  EXPECT_EQ(both.angle, std::vector<float>(3, -1.f));
  const Freak left_view(left), right_view(right);
  for (int row = 0; row < both.rows.rows; ++row) {
    const StereoKeypoint& k = keypoints[static_cast<std::size_t>(both.index[static_cast<std::size_t>(row)])];
    EXPECT_TRUE(synthetic::equalMats(both.rows.row(row), rowsOf(left_view, right_view, k))) << "row " << row;
  }
  const DescribedKeypoints left_alone =
      StereoDescriptor(withLayout(DescriptorLayout::kLeft)).describe(left, right, keypoints);
  EXPECT_EQ(left_alone.index, kFitting);
  EXPECT_TRUE(synthetic::equalMats(both.rows.colRange(0, Freak::kBytes), left_alone.rows));
}

/// What fits is described as ever; what does not, as if the image went on as its outermost pixels.
TEST(StereoDescriptor, ExtendsTheBorder) {
  constexpr int kMargin = 100;
  const cv::Mat left = view(1), right = view(2);
  cv::Mat large_left, large_right;
  cv::copyMakeBorder(left, large_left, kMargin, kMargin, kMargin, kMargin, cv::BORDER_REPLICATE);
  cv::copyMakeBorder(right, large_right, kMargin, kMargin, kMargin, kMargin, cv::BORDER_REPLICATE);
  // Inside, beyond the left view's top, beyond the right view's left, and two that not even a size of 5 px, a reach
  // of 15.7 px, fits.
  const std::vector<StereoKeypoint> keypoints = {{160.25f, 95.f, 150.f, 95.4f, 20.f},
                                                 {200.f, 16.f, 180.f, 16.f, 20.f},
                                                 {50.5f, 90.f, 16.f, 90.5f, 30.f},
                                                 {200.f, 15.f, 180.f, 15.f, 20.f},
                                                 {50.f, 90.f, 15.f, 90.f, 8.f}};
  for (const bool oriented : {false, true}) {
    DescriptorOptions options = withLayout(DescriptorLayout::kLeftAndRight, oriented);
    options.extend_border = true;
    const DescribedKeypoints described = StereoDescriptor(options).describe(left, right, keypoints);
    ASSERT_EQ(described.index, (std::vector<int>{0, 1, 2}));
    options.extend_border = false;
    const StereoDescriptor plain(options);
    for (int row = 0; row < described.rows.rows; ++row) {
      StereoKeypoint k = keypoints[static_cast<std::size_t>(row)];
      k.u_left += kMargin, k.v_left += kMargin, k.u_right += kMargin, k.v_right += kMargin;
      const DescribedKeypoints expected = plain.describe(large_left, large_right, {k});
      ASSERT_EQ(expected.rows.rows, 1);
      // Floats lose digits when positions move by the margin; few bits depend on those.
      EXPECT_LE(cv::norm(described.rows.row(row), expected.rows, cv::NORM_HAMMING), 3.0) << "row " << row;
      EXPECT_NEAR(described.angle[static_cast<std::size_t>(row)], expected.angle[0], 1e-3);
    }
    EXPECT_EQ(plain.describe(left, right, keypoints).index, (std::vector<int>{0}));
  }
}

TEST(StereoDescriptor, OrientedHalvesTurnByTheLeftAngle) {
  const cv::Mat left = view(1), right = view(2);
  const std::vector<StereoKeypoint> keypoints = mixedKeypoints();
  const DescribedKeypoints described =
      StereoDescriptor(withLayout(DescriptorLayout::kLeftAndRight, true)).describe(left, right, keypoints);
  ASSERT_EQ(described.index, kFitting);
  const Freak left_view(left), right_view(right);
  for (std::size_t row = 0; row < described.index.size(); ++row) {
    const StereoKeypoint& k = keypoints[static_cast<std::size_t>(described.index[row])];
    const float angle = left_view.orientation({k.u_left, k.v_left, k.size, -1.f});
    EXPECT_NEAR(std::remainder(described.angle[row] - angle, 2.0 * CV_PI), 0.0, 1e-5);
    EXPECT_GE(described.angle[row], 0.f);
    EXPECT_LT(described.angle[row], static_cast<float>(2.0 * CV_PI));
    const cv::Mat expected = rowsOf(left_view, right_view, k, angle);
    EXPECT_TRUE(synthetic::equalMats(described.rows.row(static_cast<int>(row)), expected)) << "row " << row;
  }
}

TEST(StereoDescriptor, TakesNoKeypoints) {
  const cv::Mat image = view(1);
  const DescribedKeypoints none =
      StereoDescriptor(withLayout(DescriptorLayout::kLeftAndRight)).describe(image, image, {});
  EXPECT_TRUE(none.index.empty());
  EXPECT_TRUE(none.angle.empty());
  EXPECT_EQ(none.rows.rows, 0);
}

TEST(StereoDescriptor, OptionsKnowWhatTheOpenCvAtHandLacks) {
  for (const std::string& name : namesOf(DescriptorType{})) {
    DescriptorOptions options;
    options.type = valueOf<DescriptorType>(name);
    const std::string lacks = errorOf([&] { makeBaseDescriptor(options.type); });
    EXPECT_EQ(errorOf([&] { checked(options); }), lacks);
  }
}

}  // namespace sdvo::test_stereo_descriptor
