#include <gtest/gtest.h>

#include <set>

#include "../../src/front_end/freak.hpp"
#include "../kernels.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_freak {

cv::Mat row(const Freak& freak, const ViewKeypoint& keypoint) {
  cv::Mat bits(1, Freak::kBytes, CV_8U);
  freak.describe({keypoint}, {bits.ptr()});
  return bits;
}

/// By definition: bit after bit, whether the first field of its pair is brighter.
cv::Mat rowByPairs(const Freak& freak, const ViewKeypoint& keypoint) {
  cv::Mat bits = cv::Mat::zeros(1, Freak::kBytes, CV_8U);
  const auto means = freak.intensities(keypoint);
  for (std::size_t bit = 0; bit < Freak::kBits; ++bit) {
    const auto& [first, second] = Freak::pairs()[bit];
    if (means[first] > means[second]) bits.ptr()[bit / 8] |= static_cast<std::uint8_t>(1u << (bit % 8));
  }
  return bits;
}

TEST(Freak, PairsAreDistinctAndValid) {
  std::set<std::pair<int, int>> distinct;
  for (const Freak::FieldPair& pair : Freak::pairs()) {
    ASSERT_LT(pair.first, Freak::kFields);
    ASSERT_LT(pair.second, Freak::kFields);
    EXPECT_NE(pair.first, pair.second);
    distinct.insert(std::minmax<int>(pair.first, pair.second));
  }
  EXPECT_EQ(distinct.size(), 512u);
}

/// Rings of six from 2/3 of the reach down to 1/12, each second one turned by half a step (Alahi et al. 2012, section
/// 4.1); a field's half side is half its ring's radius.
TEST(Freak, PatternIsThePublishedRetina) {
  const double unit = (2.0 / 3.0 - 1.0 / 12.0) / 21.0;
  const double radius[] = {2.0 / 3.0,
                           2.0 / 3.0 - 6 * unit,
                           2.0 / 3.0 - 11 * unit,
                           2.0 / 3.0 - 15 * unit,
                           2.0 / 3.0 - 18 * unit,
                           2.0 / 3.0 - 20 * unit,
                           1.0 / 12.0};
  for (std::size_t ring = 0; ring < 7; ++ring)
    for (std::size_t k = 0; k < 6; ++k) {
      const Freak::Field& field = Freak::pattern()[6 * ring + k];
      const double degrees = 60.0 * static_cast<double>(k) + (ring % 2 == 1 ? 30.0 : 0.0);
      EXPECT_NEAR(field.x, radius[ring] * std::cos(degrees * CV_PI / 180.0), 1e-7) << ring << ", " << k;
      EXPECT_NEAR(field.y, radius[ring] * std::sin(degrees * CV_PI / 180.0), 1e-7) << ring << ", " << k;
      EXPECT_NEAR(field.sigma, 0.5 * radius[ring], 1e-7) << ring << ", " << k;
    }
  EXPECT_EQ(std::hypot(Freak::pattern().back().x, Freak::pattern().back().y), 0.0);
  EXPECT_NEAR(Freak::pattern().back().sigma, 0.5 * radius[6], 1e-7);
  EXPECT_NEAR(Freak::reach(7.0), 22.0, 1e-12);
  EXPECT_NEAR(Freak::reach(14.0), 44.0, 1e-12);
}

TEST(Freak, IntensitiesAreExactBoxMeans) {
  const cv::Mat image = synthetic::noise({97, 91}, 7);
  const Freak freak(image);
  for (const ViewKeypoint& keypoint : {ViewKeypoint{48.f, 45.f, 7.f, -1.f}, ViewKeypoint{50.f, 44.f, 12.f, -1.f},
                                       ViewKeypoint{47.3f, 45.8f, 11.37f, -1.f}, ViewKeypoint{47.25f, 44.5f, 5.f, 1.1f},
                                       ViewKeypoint{48.f, 45.f, 2.f, -1.f}}) {
    const auto means = freak.intensities(keypoint);
    const double reach = Freak::reach(keypoint.size), angle = std::max(keypoint.angle, 0.f);
    for (std::size_t i = 0; i < means.size(); ++i) {
      const Freak::Field& field = Freak::pattern()[i];
      const double x = keypoint.u + reach * (std::cos(angle) * field.x - std::sin(angle) * field.y);
      const double y = keypoint.v + reach * (std::sin(angle) * field.x + std::cos(angle) * field.y);
      // A field is never finer than a pixel.
      EXPECT_NEAR(means[i], synthetic::meanByArea(image, x, y, std::max(reach * field.sigma, 0.5)), 1.0 / 256.0)
          << "field " << i << ", size " << keypoint.size;
    }
  }
}

/// Nothing is brighter than anything else on an even surface, at whatever fraction of a pixel the boxes end.
TEST(Freak, SetsNoBitOnAnEvenImage) {
  for (const int grey : {0, 1, 77, 200, 255}) {
    const Freak freak(cv::Mat(301, 301, CV_8U, cv::Scalar(grey)));
    for (const float size : {5.3f, 7.f, 11.9f, 20.f})
      for (const float angle : {-1.f, 0.7f})
        EXPECT_EQ(cv::norm(row(freak, {150.3f, 149.6f, size, angle}), cv::NORM_HAMMING), 0.0)
            << "grey level " << grey << ", size " << size << ", angle " << angle;
  }
}

/// The sum over symmetric pairs of the difference of intensity along the unit vector between the fields (Alahi et al.
/// 2012, section 4.4), far pairs and near ones alike.
TEST(Freak, OrientationIsThePublishedSum) {
  const Freak freak(synthetic::noise({97, 91}, 7));
  for (float u = 42.f; u < 54.f; u += 2.7f) {
    const ViewKeypoint keypoint{u, 45.8f, 11.f, -1.f};
    const auto means = freak.intensities(keypoint);
    double x = 0.0, y = 0.0;
    const auto add = [&](std::size_t a, std::size_t b) {
      const double dx = Freak::pattern()[a].x - Freak::pattern()[b].x,
                   dy = Freak::pattern()[a].y - Freak::pattern()[b].y;
      x += (means[a] - means[b]) * dx / std::hypot(dx, dy);
      y += (means[a] - means[b]) * dy / std::hypot(dx, dy);
    };
    for (std::size_t ring = 0; ring < 30; ring += 6) {
      for (std::size_t k = 0; k < 3; ++k) add(ring + k, ring + k + 3);
      for (std::size_t k = 0; k < 6; ++k) add(ring + k, ring + (k + 2) % 6);
    }
    const double angle = freak.orientation(keypoint);
    EXPECT_NEAR(std::remainder(angle - std::atan2(y, x), 2.0 * CV_PI), 0.0, 1e-5) << u;
    EXPECT_TRUE(angle >= 0.0 && angle <= static_cast<float>(2.0 * CV_PI)) << angle;
  }
}

TEST(Freak, OrientationPointsUphill) {
  for (const double degrees : {0.0, 60.0, 200.0, 300.0}) {
    const double angle = degrees * CV_PI / 180.0;
    const Freak freak(synthetic::render({121, 121}, [&](double u, double v) {
      return 128.0 + 1.2 * ((u - 60.0) * std::cos(angle) + (v - 60.0) * std::sin(angle));
    }));
    // Rounding to whole grey levels leaves a small fraction of a degree.
    EXPECT_NEAR(std::remainder(freak.orientation({60.f, 60.f, 12.f, -1.f}) - angle, 2.0 * CV_PI), 0.0, 0.01) << degrees;
  }
}

TEST(Freak, FitsEndsExactlyAtTheBorders) {
  const cv::Size size(100, 80);
  const float reach = 22.f, keypoint_size = 7.f;
  // The image covers half a pixel beyond the outer pixels' centres.
  const float low = reach - 0.5f, right = 100.f - 0.5f - reach, bottom = 80.f - 0.5f - reach;
  for (const cv::Point2f& inside : {cv::Point2f(low, low), cv::Point2f(right, low), cv::Point2f(low, bottom),
                                    cv::Point2f(right, bottom), cv::Point2f(50.f, 40.f)})
    EXPECT_TRUE(Freak::fits({inside.x, inside.y, keypoint_size, -1.f}, size)) << inside;
  const float below = std::nextafter(low, 0.f), beyond_right = std::nextafter(right, 100.f),
              beyond_bottom = std::nextafter(bottom, 100.f);
  for (const cv::Point2f& outside :
       {cv::Point2f(below, 40.f), cv::Point2f(50.f, below), cv::Point2f(beyond_right, 40.f),
        cv::Point2f(50.f, beyond_bottom), cv::Point2f(-5.f, -5.f)})
    EXPECT_FALSE(Freak::fits({outside.x, outside.y, keypoint_size, -1.f}, size)) << outside;
  EXPECT_FALSE(Freak::fits({50.f, 40.f, std::nextafter(40.f * 7.f / 22.f, 100.f) + 0.2f, -1.f}, size));
  EXPECT_FALSE(Freak::fits({50.f, 40.f, 0.f, -1.f}, size));
  EXPECT_FALSE(Freak::fits({50.f, 40.f, std::nanf(""), -1.f}, size));
  EXPECT_FALSE(Freak::fits({std::nanf(""), 40.f, 7.f, -1.f}, size));
}

TEST(Freak, FieldsOfAFittingKeypointStayInsideAtAnyAngle) {
  // White image: any part of a box outside of it would darken a mean.
  const cv::Mat white(80, 100, CV_8U, cv::Scalar(200));
  const Freak freak(white);
  for (float angle = 0.f; angle < 6.28f; angle += 0.1f)
    for (const ViewKeypoint& keypoint :
         {ViewKeypoint{21.5f, 21.5f, 7.f, angle}, ViewKeypoint{77.5f, 57.5f, 7.f, angle}})
      for (const float mean : freak.intensities(keypoint)) EXPECT_NEAR(mean, 200.f, 1e-3f) << "angle " << angle;
}

TEST(Freak, BitsCompareThePairsInOrder) {
  const cv::Mat image = synthetic::noise({231, 177}, 7);
  const Freak freak(image);
  cv::RNG random(5);
  std::vector<ViewKeypoint> keypoints;
  while (keypoints.size() < 203) {  // no whole number of registers
    const float size = random.uniform(0.3f, 20.f), angle = random.uniform(-3.f, 6.28f);
    const ViewKeypoint keypoint{random.uniform(0.f, 231.f), random.uniform(0.f, 177.f), size, angle};
    if (Freak::fits(keypoint, image.size())) keypoints.push_back(keypoint);
  }
  // As near to the image's corners as they fit.
  const float reach = static_cast<float>(Freak::reach(7.f));
  for (const float u : {reach - 0.5f, 230.5f - reach})
    for (const float v : {reach - 0.5f, 176.5f - reach}) {
      const ViewKeypoint keypoint{u, v, 6.999f, -1.f};
      ASSERT_TRUE(Freak::fits(keypoint, image.size()));
      keypoints.push_back(keypoint);
    }
  std::vector<cv::Mat> described;
  std::vector<std::uint8_t*> rows;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    described.emplace_back(1, Freak::kBytes, CV_8U);
    rows.push_back(described.back().ptr());
  }
  withEveryKernel([&] {
    freak.describe(keypoints, rows);
    for (std::size_t i = 0; i < keypoints.size(); ++i)
      ASSERT_EQ(cv::norm(described[i], rowByPairs(freak, keypoints[i]), cv::NORM_HAMMING), 0.0) << i;
  });
}

}  // namespace sdvo::test_freak
