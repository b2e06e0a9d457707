#include <gtest/gtest.h>

#include "../../src/check/row_check.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_row_check {

const cv::Size kSize(320, 240);
constexpr double kDisparity = 12.0, kPeriod = 0.1;  // px, s

/// Rows of a plane that nods: how far it is down at a time, px.
double nod(double time) {
  return 12.0 * std::sin(2.0 * time);
}

/// The view `down` px lower, `dv` by place lower still.
template <class Rows>
cv::Mat view(double down, double disparity, const Rows& dv) {
  static const synthetic::Texture texture(7, 6.0, 120.0);
  return synthetic::render(kSize, [&](double u, double v) { return texture.at(u + disparity, v - down - dv(u, v)); });
}

/// 40 pairs whose right image is `delay` (s) later.
template <class Rows>
RowCheck checked(double delay, double motion, const Rows& dv) {
  RowCheck check(1.5, 48.0, 24.0);
  CornerPairs pairs;
  for (int i = 0; i < 60; ++i) {
    const double time = i * kPeriod;
    const auto pair =
        pairs.add(view(motion * nod(time), 0.0, [](double, double) { return 0.0; }),
                  view(motion * nod(time + delay), kDisparity, dv), static_cast<std::int64_t>(1e9 * (time + 1.0)));
    if (pair) check.add(*pair);
  }
  return check;
}

double none(double, double) {
  return 0.0;
}

TEST(RowCheck, JudgesRowsAndTheMomentApart) {
  struct Case {
    const char* rig;
    double delay, motion;
    std::function<double(double, double)> dv;
    Verdict rows, moment;
  };
  const auto low = [](double, double) { return 0.7; };                             // px; 1.5 are allowed
  const auto right_edge = [](double u, double) { return u > 260.0 ? 2.5 : 0.0; };  // px, in a fifth of the image
  for (const Case& c : {Case{"in order", 0.0, 1.0, none, Verdict::kOk, Verdict::kOk},
                        Case{"rows differ by less than matching allows", 0.0, 0.0, low, Verdict::kWarn, Verdict::kOpen},
                        Case{"more than a tenth is out of reach", 0.0, 0.0, right_edge, Verdict::kFail, Verdict::kOpen},
                        Case{"late, of a camera that stands", 0.03, 0.0, none, Verdict::kOk, Verdict::kOpen}}) {
    const RowCheck check = checked(c.delay, c.motion, c.dv);
    EXPECT_EQ(check.rectification().verdict, c.rows) << c.rig << ": " << check.rectification().what;
    EXPECT_EQ(check.sameMoment().verdict, c.moment) << c.rig << ": " << check.sameMoment().what;
  }
}

TEST(RowCheck, MeasuresADelayWithoutBlamingTheRectification) {
  const RowCheck check = checked(0.03, 1.0, none);
  const Finding moment = check.sameMoment();
  EXPECT_EQ(moment.verdict, Verdict::kFail) << moment.what;
  double late = 0.0;
  ASSERT_EQ(std::sscanf(moment.what.c_str(), "right images are taken %lf", &late), 1);
  EXPECT_NEAR(late, 30.0, 2.0) << "ms; a row goes 24 px/s, so that 2 ms are 0.05 px";
  EXPECT_EQ(check.rectification().verdict, Verdict::kOk) << check.rectification().what;
}

TEST(RowCheck, MapsTheRowsOfABadRectificationWithoutBlamingTheMoment) {
  const auto tilted = [](double u, double v) { return 0.02 * (u - 160.0) + 0.01 * (v - 120.0); };
  const RowCheck check = checked(0.0, 1.0, tilted);
  EXPECT_EQ(check.rectification().verdict, Verdict::kFail) << check.rectification().what;
  EXPECT_EQ(check.sameMoment().verdict, Verdict::kOk) << check.sameMoment().what;
  const cv::Mat map = check.map();
  ASSERT_EQ(map.size(), cv::Size(RowDelay::kColumns, RowDelay::kRows));
  const double width = static_cast<double>(kSize.width) / RowDelay::kColumns;
  const double height = static_cast<double>(kSize.height) / RowDelay::kRows;
  // Corners lie anywhere in their part, 27 px to either side of its middle and as far above and below; half of that is
  // more than their median errs. The view nods by 12 px.
  for (int row = 0; row < RowDelay::kRows; ++row)
    for (int column = 1; column < RowDelay::kColumns - 1; ++column)
      EXPECT_NEAR(map.at<double>(row, column), tilted((column + 0.5) * width - kDisparity, (row + 0.5) * height),
                  0.01 * width + 0.005 * height)
          << row << " " << column;
}

TEST(RowCheck, JudgesNothingWithoutTexture) {
  RowCheck check(1.5, 48.0, 24.0);
  const cv::Mat grey(kSize, CV_8U, cv::Scalar(90));
  CornerPairs pairs;
  for (int i = 0; i < 60; ++i)
    if (const auto pair = pairs.add(grey, grey, (i + 1) * 100000000LL)) check.add(*pair);
  EXPECT_EQ(check.rectification().verdict, Verdict::kOpen);
  EXPECT_EQ(check.sameMoment().verdict, Verdict::kOpen);
  EXPECT_TRUE(std::isnan(check.map().at<double>(0)));
}

TEST(CheckMoment, NamesWhatIsProvedAndNothingElse) {
  constexpr double kUnknown = NAN;
  for (const RowDelay::Estimate& right : {RowDelay::Estimate{kUnknown, kUnknown}, {0.0005, 0.0001}, {0.02, 0.02}})
    EXPECT_EQ(checkMoment(right).verdict, Verdict::kOk) << "less than matters, or within chance";
  EXPECT_EQ(checkMoment({-0.0062, 0.0001}).verdict, Verdict::kWarn);
  expectWords(checkMoment({-0.0062, 0.0001}).text(), {"6.2 +- 0.1 ms before", "right_delay"});
  expectWords(checkMoment({0.0162, 0.0001}).what, {"16.2 +- 0.1 ms after"});
  EXPECT_EQ(checkMoment({0.0162, 0.0001}).verdict, Verdict::kFail);
}

}  // namespace sdvo::test_row_check
