#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "../../src/check/focus_check.hpp"
#include "../said.hpp"

namespace sdvo::test_focus_check {

/// Boxes of all grey levels, blurred by `sigma_u` and `sigma_v` px, with the noise of a camera.
cv::Mat boxes(double sigma_u, double sigma_v, double noise, int seed) {
  cv::RNG random(seed);
  cv::Mat image(240, 424, CV_8U, cv::Scalar(100));
  for (int i = 0; i < 60; ++i)
    cv::rectangle(image,
                  {random.uniform(0, 424), random.uniform(0, 240), random.uniform(10, 80), random.uniform(10, 80)},
                  cv::Scalar(random.uniform(0, 256)), cv::FILLED);
  cv::GaussianBlur(image, image, {0, 0}, sigma_u, sigma_v);
  cv::Mat grains(image.size(), CV_16S), sum;
  random.fill(grains, cv::RNG::NORMAL, 0.0, noise);
  cv::add(image, grains, sum, cv::noArray(), CV_8U);
  return sum;
}

TEST(FocusCheck, NamesTheBlurOfEachSideWhateverTheNoise) {
  struct Case {
    const char* name;
    double left, right, noise;  ///< px, px, grey levels
    Verdict verdict;
  };
  for (const Case& c :
       {Case{"sharp", 0.3, 0.3, 1.5, Verdict::kOk}, Case{"sharp in the dark", 0.3, 0.3, 8.0, Verdict::kOk},
        Case{"a soft lens", 2.0, 2.0, 1.5, Verdict::kOk}, Case{"soft", 5.0, 5.0, 1.5, Verdict::kWarn},
        Case{"right alone", 0.3, 5.0, 5.0, Verdict::kWarn}, Case{"left alone", 9.0, 0.3, 1.5, Verdict::kFail},
        Case{"both", 9.0, 9.0, 5.0, Verdict::kFail}}) {
    FocusCheck check;
    for (int i = 0; i < 10; ++i)
      check.add(boxes(c.left, c.left, c.noise, i), boxes(c.right, c.right, c.noise, 100 + i));
    const Finding finding = check.judge();
    EXPECT_EQ(finding.verdict, c.verdict) << c.name << ": " << finding.text();
    double left = 0.0, right = 0.0;
    std::sscanf(finding.what.c_str(), "edges are at most %lf px wide in left images, %lf", &left, &right);
    EXPECT_NEAR(left, std::max(c.left, 1.0), 0.3 + 0.2 * c.left) << c.name;
    EXPECT_NEAR(right, std::max(c.right, 1.0), 0.3 + 0.2 * c.right) << c.name;
  }
}

TEST(FocusCheck, MotionThatBlursOneDirectionIsNoFocus) {
  FocusCheck check;
  for (int i = 0; i < 10; ++i) check.add(boxes(8.0, 0.3, 1.5, i), boxes(8.0, 0.3, 1.5, i));
  EXPECT_EQ(check.judge().verdict, Verdict::kOk) << check.judge().text();
}

TEST(FocusCheck, NoiseAloneHasNoEdges) {
  FocusCheck check;
  EXPECT_EQ(check.judge().verdict, Verdict::kOpen);
  for (int i = 0; i < 10; ++i) {
    cv::Mat noise(240, 424, CV_8U);
    cv::RNG(i).fill(noise, cv::RNG::NORMAL, 100.0, 3.0);
    check.add(noise, noise);
  }
  EXPECT_EQ(check.judge().verdict, Verdict::kOpen) << check.judge().text();
}

}  // namespace sdvo::test_focus_check
