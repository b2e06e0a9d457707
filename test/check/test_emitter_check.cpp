#include <gtest/gtest.h>

#include "../../src/check/image_check.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_emitter_check {

const cv::Size kSize(424, 240);

/// A scene that moves `step` px to the left with each pair, under `dots` bright dots that do not move with it.
Finding judged(double step, int dots, int dot_step = 0) {
  const synthetic::Texture texture(3, 8.0, 160.0);
  std::mt19937 random(9);
  std::vector<cv::Point> pattern;
  for (int i = 0; i < dots; ++i)
    pattern.emplace_back(std::uniform_int_distribution<int>(0, 2000)(random),
                         std::uniform_int_distribution<int>(1, kSize.height - 2)(random));
  EmitterCheck check;
  for (int i = 0; i < 12; ++i) {
    cv::Mat image = synthetic::render(kSize, [&](double u, double v) { return 0.5 * texture.at(u + i * step, v); });
    for (const cv::Point& dot : pattern)
      if (const int u = dot.x - i * dot_step; u > 0 && u < kSize.width - 1) image.at<std::uint8_t>(dot.y, u) = 200;
    check.add(image);
  }
  return check.judge();
}

TEST(EmitterCheck, FindsDotsThatMoveWithTheCamera) {
  EXPECT_EQ(judged(8.0, 6000).verdict, Verdict::kFail);
  EXPECT_EQ(judged(8.0, 0).verdict, Verdict::kOk) << "a moving scene";
  EXPECT_EQ(judged(8.0, 6000, 8).verdict, Verdict::kOk) << "dots of the scene";
  EXPECT_EQ(judged(0.0, 6000).verdict, Verdict::kOpen) << "a camera that stands proves nothing";
}

/// Bright spots of the scene behind them stay, of a camera that stands.
TEST(EmitterCheck, PeopleWhoPassProveNothing) {
  const synthetic::Texture scene(3, 8.0, 160.0), person(4, 8.0, 160.0);
  std::mt19937 random(9);
  std::vector<cv::Point> spots;
  for (int i = 0; i < 3000; ++i)
    spots.emplace_back(std::uniform_int_distribution<int>(1, kSize.width - 2)(random),
                       std::uniform_int_distribution<int>(1, kSize.height - 2)(random));
  const auto isOfPerson = [](double u) { return u > 20.0 && u < 120.0; };
  EmitterCheck check;
  for (int i = 0; i < 30; ++i) {
    cv::Mat image = synthetic::render(
        kSize, [&](double u, double v) { return 0.5 * (isOfPerson(u) ? person.at(u + 8.0 * i, v) : scene.at(u, v)); });
    for (const cv::Point& spot : spots)
      if (!isOfPerson(spot.x)) image.at<std::uint8_t>(spot) = 200;
    check.add(image);
  }
  EXPECT_EQ(check.judge().verdict, Verdict::kOpen);
}

}  // namespace sdvo::test_emitter_check
