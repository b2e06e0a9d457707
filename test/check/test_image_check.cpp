#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "../../src/check/image_check.hpp"
#include "../said.hpp"

namespace sdvo::test_image_check {

const cv::Size kSize(212, 120);

/// The extraction's report of a good pair with these mean grey levels.
ExtractionReport goodReport(double left = 100.0, double right = 110.0) {
  ExtractionReport report;
  report.detected = 500, report.stereo_matched = 400;
  report.mean_intensity[0] = left, report.mean_intensity[1] = right;
  report.sharpness[0] = report.sharpness[1] = 10.0;
  return report;
}

cv::Mat grey(int level) {
  return cv::Mat(kSize, CV_8U, cv::Scalar(level));
}

/// Ten pairs with one report.
ImageCheck checked(const ExtractionReport& report, const cv::Mat& left = grey(100), const cv::Mat& right = grey(100)) {
  ImageCheck check;
  for (int i = 0; i < 10; ++i) check.add(left, right, report);
  return check;
}

void expectSaid(const Finding& finding, Verdict verdict, const std::string& words) {
  EXPECT_EQ(finding.verdict, verdict) << finding.what;
  EXPECT_TRUE(contains((finding.what + finding.remedy), words)) << finding.what << "; " << finding.remedy;
}

TEST(ImageCheck, ExposureIsThatOfTheDarkerAndOfTheBrighterSide) {
  const auto exposure = [](double left, double right) {
    return checked(goodReport(left, right)).exposure(30.0, 220.0);
  };
  expectSaid(exposure(40.0, 210.0), Verdict::kOk, "mean grey level 40 to 210, 0 % white");
  expectSaid(exposure(210.0, 29.0), Verdict::kWarn, "too dark");
  expectSaid(exposure(29.0, 28.0), Verdict::kFail, "too dark");
  expectSaid(exposure(100.0, 221.0), Verdict::kWarn, "too bright");
}

TEST(ImageCheck, ExposuresThatTakeTurnsAreNamedAndNoLampIs) {
  ImageCheck turns, mild, lamp;
  const auto add = [](ImageCheck& check, double mean) { check.add(grey(100), grey(100), goodReport(mean, mean)); };
  for (int i = 0; i < 20; ++i) {
    add(turns, i % 2 ? 6.0 : 150.0);
    add(mild, i % 2 ? 20.0 : 140.0);
    add(lamp, i % 6 < 3 ? 6.0 : 150.0);
    EXPECT_FALSE(contains(lamp.exposure(10.0, 220.0).text(), "take turns"));
  }
  expectSaid(turns.exposure(10.0, 220.0), Verdict::kWarn, "take turns");
  expectSaid(mild.exposure(10.0, 220.0), Verdict::kOk, "mean grey level 20 to 140");
}

TEST(ImageCheck, WhiteInAQuarterOfBothImagesIsTooBright) {
  const auto withWhite = [](int columns) {
    cv::Mat left = grey(100);
    left.colRange(0, columns) = 255;
    return checked(goodReport(), left, grey(100)).exposure(30.0, 220.0);
  };
  expectSaid(withWhite(kSize.width / 4), Verdict::kOk, "12 % white");
  expectSaid(withWhite(kSize.width * 3 / 5), Verdict::kWarn, "too bright");
}

TEST(ImageCheck, TextureIsCornersThatAreFoundInBothImages) {
  const auto texture = [](int corners, int matched) {
    ExtractionReport report = goodReport();
    report.detected = corners, report.stereo_matched = matched;
    return checked(report).texture(100, 0.5);
  };
  expectSaid(texture(100, 50), Verdict::kOk, "100 corners");
  expectSaid(texture(99, 90), Verdict::kFail, "scene with texture");
  expectSaid(texture(100, 49), Verdict::kWarn, "max_disparity");
  expectSaid(texture(0, 0), Verdict::kFail, "0 % are found");
  ImageCheck check = checked(goodReport());
  ExtractionReport bare = goodReport();
  bare.detected = bare.stereo_matched = 20;
  for (int i = 0; i < 2; ++i) check.add(grey(100), grey(100), bare);
  expectSaid(check.texture(100, 0.5), Verdict::kWarn, "some views");
}

/// A view of a scene of noise, moved to the right by `right` px.
cv::Mat view(int right) {
  static const cv::Mat scene = [] {
    cv::Mat noise(kSize.height, 3000, CV_8U);
    cv::RNG(3).fill(noise, cv::RNG::UNIFORM, 0, 256);
    cv::blur(noise, noise, cv::Size(5, 5));
    return noise;
  }();
  return scene.colRange(right, right + kSize.width).clone();
}

/// 15 pairs that stand still and 15 that move by `motion` px each, `sharpness` (grey levels) while moving.
ImageCheck swept(int motion, double sharpness) {
  ImageCheck check;
  int right = 0;
  for (int i = 0; i < 31; ++i) {
    ExtractionReport report = goodReport();
    if (i > 15) right += motion, report.sharpness[0] = sharpness;
    check.add(view(right), view(right), report);
  }
  return check;
}

TEST(ImageCheck, BlurIsWhatMotionTakesOfTheSharpness) {
  expectSaid(swept(10, 7.5).blur(), Verdict::kOk, "75 % of the sharpness");
  expectSaid(swept(10, 5.0).blur(), Verdict::kWarn, "fast views have 50 % of the sharpness");
  expectSaid(swept(1, 5.0).blur(), Verdict::kOpen, "did not move enough");
}

/// Motion of the view from pair to pair that the check reports, % of the width.
double shareOfView(const ImageCheck& check) {
  double turn = 0.0, share = 0.0;
  std::sscanf(check.frameRate({0.0}).what.c_str(), "up to %lf deg (limit 20.0) and %lf", &turn, &share);
  return share;
}

TEST(ImageCheck, TheFrameRateIsTooLowWhereThePairsHaveTooLittleInCommon) {
  EXPECT_EQ(ImageCheck().frameRate({}).verdict, Verdict::kOpen);
  const ImageCheck slow = swept(21, 10.0), fast = swept(64, 10.0);
  ImageCheck unrelated;
  for (int i = 0; i < 10; ++i) unrelated.add(view(i * kSize.width), view(i * kSize.width), goodReport());
  expectSaid(slow.frameRate({4.0}), Verdict::kOk, "up to 4.0 deg (limit 20.0) and ");
  EXPECT_NEAR(shareOfView(slow), 100.0 * 21 / 212, 1.0) << "to a pixel of a hundred columns";
  expectSaid(slow.frameRate({11.0}), Verdict::kWarn, "a higher frame rate");
  expectSaid(slow.frameRate({21.0}), Verdict::kFail, "a higher frame rate");
  expectSaid(fast.frameRate({4.0}), Verdict::kWarn, "a higher frame rate");
  EXPECT_NEAR(shareOfView(fast), 100.0 * 64 / 212, 1.0);
  expectSaid(unrelated.frameRate({4.0}), Verdict::kWarn, "nothing in common");
}

TEST(RepeatCheck, ASideThatRepeatsIsNamedAndBothOnesAfterASecond) {
  struct Case {
    bool left, right;  ///< changes
    const char* words;
    Verdict verdict;
  };
  for (const Case& c :
       {Case{true, true, "", Verdict::kOk}, Case{true, false, "the right images repeat", Verdict::kFail},
        Case{false, true, "the left images repeat", Verdict::kFail},
        Case{false, false, "the images repeat bit by bit: is the driver", Verdict::kWarn}}) {
    RepeatCheck check;
    for (int i = 0; i < 25; ++i) {
      check.add(grey(c.left ? i : 0), grey(c.right ? 50 + i : 50), i * 50'000'000LL);
      if (i == 2) {
        EXPECT_EQ(check.problem(), "") << "a driver may hand out an image twice";
      }
    }
    EXPECT_EQ(check.problem().substr(0, std::string(c.words).size()), c.words);
    EXPECT_EQ(check.problem().empty(), c.left && c.right);
    EXPECT_EQ(check.judge().verdict, c.verdict) << c.words;
  }
}

}  // namespace sdvo::test_image_check
