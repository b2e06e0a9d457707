#include <gtest/gtest.h>

#include <set>

#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"

namespace sdvo::test_feature_matcher {

using synthetic::addFeature;
using synthetic::noFeatures;
using synthetic::randomRow;

std::vector<FeatureMatch> matchWithoutGate(const StereoFeatures& reference, const StereoFeatures& current,
                                           double max_distance = FeatureMatcherOptions().max_distance) {
  FeatureMatcherOptions options;
  options.max_distance = max_distance;
  return FeatureMatcher(options).match(reference, current, std::nullopt);
}

/// The row with its first `count` bits turned over.
std::vector<std::uint8_t> flipped(std::vector<std::uint8_t> row, int count) {
  for (int bit = 0; bit < count; ++bit)
    row[static_cast<std::size_t>(bit / 8)] =
        static_cast<std::uint8_t>(row[static_cast<std::size_t>(bit / 8)] ^ (1 << (bit % 8)));
  return row;
}

TEST(FeatureMatcher, FindsShuffledFeaturesAmongStrangers) {
  const StereoCamera camera = synthetic::camera();
  const synthetic::World world = synthetic::randomWorld(1, 400, {-8.0, -4.0, 4.0}, {8.0, 4.0, 30.0});
  synthetic::Sighting first, second;
  first.seed = 1, second.seed = 2;
  first.flipped = second.flipped = 0.05;
  first.strangers = 100, second.strangers = 150;
  const StereoFeatures reference = synthetic::observe(world, camera, Eigen::Isometry3d::Identity(), 1, first);
  const StereoFeatures current = synthetic::observe(world, camera, Eigen::Isometry3d::Identity(), 2, second);
  const int common = reference.count() - 100;
  ASSERT_EQ(current.count() - 150, common);

  const std::vector<FeatureMatch> matches = matchWithoutGate(reference, current);
  // Two rows of one point differ by 2 * 0.05 * 0.95 of their bits, strangers by half, six standard deviations from 0.3.
  EXPECT_EQ(static_cast<int>(matches.size()), common);
  for (const FeatureMatch& match : matches) {
    EXPECT_EQ(reference.u[static_cast<std::size_t>(match.reference)],
              current.u[static_cast<std::size_t>(match.current)]);
    EXPECT_NEAR(
        match.distance,
        synthetic::differingBits(reference.descriptors.row(match.reference), current.descriptors.row(match.current)),
        1e-6);
  }
}

TEST(FeatureMatcher, IsOneToOneAndInTheOrderOfTheReference) {
  std::mt19937 random(3);
  StereoFeatures reference = noFeatures(synthetic::camera()), current = noFeatures(synthetic::camera());
  const auto row = randomRow(random, 128);
  // Three look-alikes compete for one: only the nearest of them may have it.
  addFeature(reference, 100, 100, 10, flipped(row, 30));
  addFeature(reference, 200, 100, 10, flipped(row, 10));
  addFeature(reference, 300, 100, 10, flipped(row, 20));
  addFeature(current, 100, 100, 10, row);
  addFeature(current, 400, 300, 10, randomRow(random, 128));
  const auto matches = matchWithoutGate(reference, current);
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_EQ(matches[0].reference, 1);
  EXPECT_EQ(matches[0].current, 0);
  EXPECT_NEAR(matches[0].distance, 10.0 / 1024.0, 1e-6);

  // The same from the other side.
  const auto turned = matchWithoutGate(current, reference);
  ASSERT_EQ(turned.size(), 1u);
  EXPECT_EQ(turned[0].current, 1);

  // Few distinct rows, many ties: still no index twice.
  StereoFeatures crowd_a = noFeatures(synthetic::camera()), crowd_b = crowd_a;
  for (int i = 0; i < 60; ++i) {
    addFeature(crowd_a, 10 * i, 100, 10, flipped(row, static_cast<int>(random() % 3)));
    addFeature(crowd_b, 10 * i, 100, 10, flipped(row, static_cast<int>(random() % 3)));
  }
  std::set<int> references, currents;
  int previous = -1;
  for (const FeatureMatch& match : matchWithoutGate(crowd_a, crowd_b)) {
    EXPECT_TRUE(references.insert(match.reference).second);
    EXPECT_TRUE(currents.insert(match.current).second);
    EXPECT_GT(match.reference, previous);
    previous = match.reference;
  }
  EXPECT_FALSE(references.empty());
}

TEST(FeatureMatcher, RefusesDistancesBeyondTheLimit) {
  std::mt19937 random(4);
  const auto row = randomRow(random, 128);
  StereoFeatures reference = noFeatures(synthetic::camera()), current = noFeatures(synthetic::camera());
  addFeature(reference, 100, 100, 10, row);
  auto other = row;
  for (std::uint8_t& byte : other) byte ^= 0x11;  // a quarter of the bits
  addFeature(current, 100, 100, 10, other);
  EXPECT_EQ(matchWithoutGate(reference, current, 0.25).size(), 1u);
  EXPECT_TRUE(matchWithoutGate(reference, current, 0.249).empty());
}

TEST(FeatureMatcher, GateHoldsThePredictedPositionAndNothingFar) {
  std::mt19937 random(5);
  const StereoCamera camera = synthetic::camera();
  const Eigen::Isometry3d T_current_reference = expSE3((Vector6d() << 0.3, -0.1, -2.0, 0.01, -0.2, -0.02).finished());
  FeatureMatcherOptions options;
  options.gate_radius = 25.0;
  const FeatureMatcher matcher(options);

  for (const Eigen::Vector3d& point : {Eigen::Vector3d(-2.0, 0.5, 9.0), Eigen::Vector3d(3.0, -1.0, 14.0)}) {
    const Eigen::Vector3d before = camera.project(point), after = camera.project(T_current_reference * point);
    ASSERT_GT((after - before).head<2>().norm(), 30.0) << "without the motion the gate would miss";
    const auto row = randomRow(random, 128);
    StereoFeatures reference = noFeatures(camera);
    addFeature(reference, before.x(), before.y(), before.x() - before.z(), row);
    const auto matchesAt = [&](double du, double dv, const std::optional<Eigen::Isometry3d>& prediction) {
      StereoFeatures current = noFeatures(camera);
      for (const double corner : {0.0, 1.0})  // strangers that stretch the grid over the image
        addFeature(current, 639.0 * corner, 479.0 * corner, 1.0, randomRow(random, 128));
      addFeature(current, after.x() + du, after.y() + dv, after.x() - after.z(), row);
      return matcher.match(reference, current, prediction).size();
    };
    EXPECT_EQ(matchesAt(0.0, 0.0, T_current_reference), 1u);
    for (int direction = 0; direction < 12; ++direction) {
      const double angle = direction * CV_PI / 6.0;
      EXPECT_EQ(matchesAt(24.9 * std::cos(angle), 24.9 * std::sin(angle), T_current_reference), 1u) << direction;
      EXPECT_EQ(matchesAt(25.1 * std::cos(angle), 25.1 * std::sin(angle), T_current_reference), 0u) << direction;
    }
    EXPECT_EQ(matchesAt(90.0, 0.0, std::nullopt), 1u) << "no prediction, no gate";
    EXPECT_EQ(matchesAt(0.0, 0.0, Eigen::Isometry3d::Identity()), 0u);
  }
}

TEST(FeatureMatcher, TakesPredictionsThatLeaveTheImageOrPassTheCamera) {
  const StereoCamera camera = synthetic::camera();
  const synthetic::World world = synthetic::randomWorld(6, 300, {-8.0, -4.0, 2.0}, {8.0, 4.0, 30.0});
  const StereoFeatures features = synthetic::observe(world, camera, Eigen::Isometry3d::Identity(), 1);
  for (const double forward : {-60.0, -4.0, 1e6}) {
    const Eigen::Isometry3d T(Eigen::Translation3d(1e3 * (forward > 0.0), 0.0, forward));
    EXPECT_LE(FeatureMatcher().match(features, features, T).size(), static_cast<std::size_t>(features.count()));
  }
}

TEST(FeatureMatcher, DoesNotLookForWhatIsBehindTheCamera) {
  std::mt19937 random(10);
  const StereoCamera camera = synthetic::camera();
  const auto row = randomRow(random, 128);
  const Eigen::Vector3d point(0.5, -0.3, 5.0);
  StereoFeatures reference = noFeatures(camera);
  const Eigen::Vector3d pixel = camera.project(point);
  addFeature(reference, pixel.x(), pixel.y(), pixel.x() - pixel.z(), row);
  const Eigen::Isometry3d passed(Eigen::Translation3d(0.0, 0.0, -10.0));
  // Where the mirrored projection of a point behind would lie.
  const Eigen::Vector3d mirrored = camera.project(passed * point);
  StereoFeatures current = noFeatures(camera);
  addFeature(current, mirrored.x(), mirrored.y(), 10.0, row);
  EXPECT_TRUE(FeatureMatcher().match(reference, current, passed).empty());
  EXPECT_EQ(FeatureMatcher().match(reference, current, std::nullopt).size(), 1u);
}

/// Descriptors of numbers: {a few of them}, written as the type's bytes.
template <class Element>
StereoFeatures numbers(ElementType type, const std::vector<std::vector<Element>>& rows) {
  StereoFeatures features = noFeatures(synthetic::camera(), 0, static_cast<int>(rows[0].size() * sizeof(Element)));
  features.element_type = type;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(rows[i].data());
    addFeature(features, 100.0 + 50.0 * static_cast<double>(i), 100.0, 10.0,
               {bytes, bytes + rows[i].size() * sizeof(Element)});
  }
  return features;
}

template <class Element>
void expectShares(ElementType type) {
  // The second of each set are the alike ones: |a - b|^2 = 1 + 4, |a|^2 = 9 + 16, |b|^2 = 16 + 36.
  const StereoFeatures a = numbers<Element>(type, {{100, 0, 0}, {3, 4, 0}});
  const StereoFeatures b = numbers<Element>(type, {{0, 0, 90}, {4, 6, 0}});
  const auto matches = matchWithoutGate(a, b, 1.0);
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_EQ(matches[0].reference, 1);
  EXPECT_EQ(matches[0].current, 1);
  EXPECT_NEAR(matches[0].distance, 5.0 / (25.0 + 52.0), 1e-6);
}

TEST(FeatureMatcher, DistanceOfNumbersIsAShareOfBothRowsLengths) {
  expectShares<std::uint8_t>(ElementType::kUint8);
  expectShares<float>(ElementType::kFloat32);
}

TEST(FeatureMatcher, CountsTheBitsOfRowsThatAreNoMultipleOfEightBytes) {
  std::mt19937 random(11);
  for (const int bytes : {1, 7, 8, 13, 20}) {
    StereoFeatures reference = noFeatures(synthetic::camera(), 0, bytes), current = reference;
    const auto row = randomRow(random, bytes);
    addFeature(reference, 100, 100, 10, row);
    auto other = row;
    other.back() = static_cast<std::uint8_t>(other.back() ^ 0x81);
    addFeature(current, 100, 100, 10, other);
    const auto matches = matchWithoutGate(reference, current);
    ASSERT_EQ(matches.size(), 1u) << bytes;
    EXPECT_NEAR(matches[0].distance, 2.0 / (8.0 * bytes), 1e-6);
  }
}

TEST(FeatureMatcher, RefusesSetsThatCannotBeCompared) {
  std::mt19937 random(7);
  StereoFeatures both = noFeatures(synthetic::camera(), 0, 128), left = noFeatures(synthetic::camera(), 0, 64);
  addFeature(both, 100, 100, 10, randomRow(random, 128));
  addFeature(left, 100, 100, 10, randomRow(random, 64));
  left.layout = DescriptorLayout::kLeft;
  expectRefusals(both, [&](const StereoFeatures& other) { FeatureMatcher().match(both, other, std::nullopt); },
                 {{[&](StereoFeatures& other) { other = left; }, "left+right"},
                  {[](StereoFeatures& other) { other.descriptor = "orb"; }, "orb"},
                  {[](StereoFeatures& other) { other.element_type = ElementType::kUint8; }, ""}});
}

TEST(FeatureMatcher, IsNotLedAstrayByTheClaimsOfAMessage) {
  // A message may claim any image and put features anywhere; a grid over all that would hold millions of cells.
  std::mt19937 random(9);
  StereoCamera camera = synthetic::camera();
  camera.width = camera.height = 1 << 30;
  StereoFeatures features = noFeatures(camera);
  for (const double far : {0.0, 1e3, 1e9, -3e38, 3e38}) addFeature(features, far, -far, 10, randomRow(random, 128));
  FeatureMatcherOptions options;
  options.gate_radius = 1.0;
  const auto matches = FeatureMatcher(options).match(features, features, Eigen::Isometry3d::Identity());
  for (const FeatureMatch& match : matches) EXPECT_EQ(match.reference, match.current);
  EXPECT_GE(matches.size(), 2u);
}

TEST(FeatureMatcher, TakesEmptySets) {
  std::mt19937 random(8);
  const StereoFeatures none = noFeatures(synthetic::camera());
  StereoFeatures one = none;
  addFeature(one, 100, 100, 10, randomRow(random, 128));
  const FeatureMatcher matcher;
  EXPECT_TRUE(matcher.match(none, one, std::nullopt).empty());
  EXPECT_TRUE(matcher.match(one, none, std::nullopt).empty());
  EXPECT_TRUE(matcher.match(none, none, Eigen::Isometry3d::Identity()).empty());
}

}  // namespace sdvo::test_feature_matcher
