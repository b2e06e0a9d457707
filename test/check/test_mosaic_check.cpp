#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "../../src/check/mosaic_check.hpp"
#include "../said.hpp"

namespace sdvo::test_mosaic_check {

/// A blurred texture with noise of 2 grey levels.
cv::Mat scene() {
  cv::Mat image(240, 376, CV_32F), noise(image.size(), CV_32F), grey;
  cv::RNG random(3);
  random.fill(image, cv::RNG::UNIFORM, 0.0, 255.0);
  random.fill(noise, cv::RNG::NORMAL, 0.0, 2.0);
  cv::GaussianBlur(image, image, {}, 1.0);
  image = 3.0 * (image - 127.0) + 110.0 + noise;
  image.convertTo(grey, CV_8U);
  return grey;
}

/// As a sensor with gains of red, green and blue sees it.
cv::Mat mosaicOf(const cv::Mat& grey, double red, double blue) {
  cv::Mat mosaic = grey.clone();
  for (int y = 0; y < grey.rows; ++y)
    for (int x = 0; x < grey.cols; ++x)
      if (y % 2 == x % 2)
        mosaic.at<std::uint8_t>(y, x) =
            cv::saturate_cast<std::uint8_t>((y % 2 == 0 ? red : blue) * grey.at<std::uint8_t>(y, x));
  return mosaic;
}

cv::Mat rectified(const cv::Mat& image) {
  const cv::Matx23d turn(0.96, -0.02, 5.3, 0.02, 0.96, 2.7);
  cv::Mat turned;
  cv::warpAffine(image, turned, turn, image.size(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
  return turned;
}

TEST(MosaicCheck, NamesTheSideThatHasThePattern) {
  const cv::Mat grey = scene();
  for (const cv::Mat& mosaic :
       {mosaicOf(grey, 0.5, 0.7), mosaicOf(grey, 1.0, 0.45), rectified(mosaicOf(grey, 0.5, 0.7))}) {
    MosaicCheck left, both;
    const auto [smooth, untouched] = left.add(mosaic, grey);
    EXPECT_LT(mosaicShare(smooth), 0.02);
    EXPECT_EQ(untouched.data, grey.data);
    both.add(mosaic, mosaic);
    expectWords(left.problem(), {"left image is", "Bayer", "stereo_raw.launch"});
    expectWords(both.problem(), {"both images"});
    EXPECT_EQ(both.judge().verdict, Verdict::kFail);
  }
}

TEST(MosaicCheck, NothingIsLeftOfThePattern) {
  const cv::Mat smooth = withoutMosaic(mosaicOf(cv::Mat(16, 16, CV_8U, cv::Scalar(200)), 0.5, 0.7));
  EXPECT_EQ(cv::norm(smooth, cv::Mat(16, 16, CV_8U, cv::Scalar(160)), cv::NORM_INF),
            0.0);  // (0.5 + 1 + 1 + 0.7) / 4 of it
}

TEST(MosaicCheck, GreyImagesHaveNone) {
  cv::Mat noise(240, 376, CV_8U), mesh(240, 376, CV_8U, cv::Scalar(90));
  cv::RNG(5).fill(noise, cv::RNG::NORMAL, 100.0, 20.0);
  for (int y = 0; y < mesh.rows; ++y)  // an interlaced camera, in motion
    if (y % 2 == 0) mesh.row(y).setTo(110);
  cv::Mat halved;
  cv::resize(scene(), halved, {}, 0.5, 0.5, cv::INTER_NEAREST);
  for (const cv::Mat& image :
       {scene(), rectified(scene()), noise, mesh, halved, cv::Mat(240, 376, CV_8U, cv::Scalar(5))})
    EXPECT_LT(mosaicShare(image), 0.1);
  MosaicCheck check;
  check.add(scene(), scene());
  EXPECT_EQ(check.problem(), "");
  EXPECT_EQ(check.judge().verdict, Verdict::kOk);
  EXPECT_EQ(MosaicCheck().judge().verdict, Verdict::kOpen);
}

TEST(MosaicCheck, RealDrivesHaveNone) {
  int images = 0;
  for (const char* variable : {"KITTI_DIR", "KARLSRUHE_DIR"})
    for (const char* sequence : {"03", "04", "06", "19"})
      if (const char* folder = std::getenv(variable))
        if (const cv::Mat image = cv::imread(std::string(folder) + "/sequences/" + sequence + "/image_0/000010.png", 0);
            !image.empty()) {
          EXPECT_LT(mosaicShare(image), 0.05) << variable << sequence;
          EXPECT_GT(mosaicShare(mosaicOf(image, 0.6, 0.7)), 0.5) << variable << sequence;
          ++images;
        }
  if (images == 0) GTEST_SKIP() << "neither KITTI_DIR nor KARLSRUHE_DIR is set";
}

}  // namespace sdvo::test_mosaic_check
