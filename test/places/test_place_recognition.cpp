#include <gtest/gtest.h>

#include <algorithm>

#include "../../src/rig/rolling_shutter.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/places/place_recognition.hpp"

namespace sdvo::test_place_recognition {

constexpr double kPi = 3.14159265358979323846;

/// The way is a circle, m, with a pair and a key frame after each step.
constexpr int kAround = 189, kStep = 3;
constexpr std::int64_t kPeriod = 300'000'000;  // ns

Eigen::AngleAxisd turned(double angle) {
  return {angle, Eigen::Vector3d::UnitY()};
}

Eigen::Isometry3d onCircle(double metres) {
  const double radius = kAround / (2.0 * kPi), angle = metres / radius;
  return Eigen::Translation3d(radius * Eigen::Vector3d(1.0 - std::cos(angle), 0.0, std::sin(angle))) * turned(angle);
}

const synthetic::World& world() {
  static const synthetic::World points = synthetic::randomWorld(1, 12000, {-40.0, -3.0, -70.0}, {100.0, 3.0, 70.0}, 64);
  return points;
}

StereoFeatures see(const Eigen::Isometry3d& T_world_camera, std::int64_t stamp) {
  synthetic::Sighting sighting;
  sighting.noise = 0.3;
  sighting.flipped = 0.08;
  sighting.strangers = 50;
  sighting.max_depth = 25.0;
  sighting.seed = static_cast<unsigned>(stamp / kPeriod) + 1;
  return synthetic::observe(world(), synthetic::camera(), T_world_camera.inverse(), stamp, sighting);
}

/// Drives along the circle at 10 m/s; the odometry turns too far by so many radians a metre.
struct Drive {
  explicit Drive(double turn_per_metre = 0.0, PlaceRecognitionOptions options = fewAndFast())
      : recognition(options), drift(turn_per_metre) {}

  static PlaceRecognitionOptions fewAndFast() {
    PlaceRecognitionOptions options;
    options.keyframe_distance = 2.5;
    options.min_age = 5.0;
    options.max_features = 300;
    return options;
  }

  /// Reports of the key frames on the way from one metre to another one.
  std::vector<PlaceReport> go(int from, int to, bool continuous = true) {
    std::vector<PlaceReport> reports;
    for (int metre = from; metre < to; metre += kStep) {
      const Eigen::Isometry3d T_true = onCircle(metre);
      if (last_true && continuous)
        T_odom_camera = T_odom_camera * last_true->inverse() * T_true * turned(drift * kStep);
      last_true = T_true;
      const CameraMotion motion{T_odom_camera, 1e-6 * Matrix6d::Identity(), continuous};
      continuous = true;
      if (auto report = recognition.observe(see(T_true, kPeriod * ++pairs), motion)) {
        if (report->loop) {
          PoseGraph graph = recognition.graph();
          graph.optimise();
          recognition.adopt(graph);
        }
        reports.push_back(*report);
      }
    }
    return reports;
  }

  /// How far the last pair is off in the map, m.
  double error() const {
    return (recognition.T_map_odom() * T_odom_camera * last_true->inverse()).translation().norm();
  }

  /// As they are saved.
  std::vector<Place> places() const {
    std::vector<Place> places;
    for (const auto& [id, place] : recognition.places()) places.push_back(place);
    return places;
  }

  PlaceRecognition recognition;
  double drift;
  int pairs = 0;
  std::optional<Eigen::Isometry3d> last_true;
  Eigen::Isometry3d T_odom_camera = onCircle(0.0);
};

int loops(const std::vector<PlaceReport>& reports) {
  int loops = 0;
  for (const PlaceReport& report : reports) loops += report.loop;
  return loops;
}

TEST(PlaceRecognition, ARoundClosesAndTheDriftIsTakenBack) {
  Drive drive(0.001);
  EXPECT_EQ(loops(drive.go(0, 150)), 0);
  const double before = (drive.T_odom_camera * drive.last_true->inverse()).translation().norm();
  ASSERT_GT(before, 3.0);
  const auto second = drive.go(150, kAround + 40);
  EXPECT_GE(loops(second), 10) << "of " << second.size() << " key frames";
  EXPECT_LT(drive.error(), 0.1 * before);
  EXPECT_GT(drive.recognition.graph().loops(), loops(second)) << "the first one waited for a neighbour to confirm it";
}

TEST(PlaceRecognition, KeyframesAreApartByWayOrByTurn) {
  Drive drive;
  drive.go(0, 33);
  EXPECT_EQ(drive.recognition.places().size(), 11u) << "every 3 m";
  PlaceRecognitionOptions sparse = Drive::fewAndFast();
  sparse.keyframe_distance = 5.0;
  Drive sparser(0.0, sparse);
  sparser.go(0, 33);
  EXPECT_EQ(sparser.recognition.places().size(), 6u) << "every second step";
  PlaceRecognition turning{PlaceRecognitionOptions()};
  for (int i = 0; i <= 60; i += 5) {
    const Eigen::Isometry3d T = onCircle(0.0) * turned(i * kPi / 180.0);
    turning.observe(see(T, kPeriod * (i + 1)), {T, Matrix6d::Zero(), true});
  }
  EXPECT_EQ(turning.places().size(), 5u) << "every 15 degrees";
}

TEST(PlaceRecognition, APairWithHardlyAnythingToSeeIsNotKept) {
  PlaceRecognition recognition{PlaceRecognitionOptions()};
  EXPECT_FALSE(recognition.observe(synthetic::noFeatures(synthetic::camera(), 1), {}).has_value());
  EXPECT_TRUE(recognition.observe(see(onCircle(0.0), 2), {}).has_value());
}

TEST(PlaceRecognition, RowsOfARollingShutterAreKeptAsOfTheStamp) {
  const StereoFeatures taken = see(onCircle(0.0), kPeriod);
  CameraMotion motion;
  motion.readout = 0.025;
  motion.velocity << 0.0, 0.0, 10.0, 0.0, 5.0, 0.0;
  const StereoFeatures global = RollingShutter::asGlobal({taken, motion.readout, motion.velocity});
  PlaceRecognition recognition(Drive::fewAndFast());
  recognition.observe(taken, motion);
  const StereoFeatures& kept = recognition.places().at(0).features;
  EXPECT_GT(kept.count(), 100);
  EXPECT_NO_THROW(kept.check()) << "what left the image cannot be saved and loaded";
  for (int i = 0; i < kept.count(); ++i) {
    const auto same = std::find(global.u.begin(), global.u.end(), kept.u[static_cast<std::size_t>(i)]);
    ASSERT_NE(same, global.u.end());
    EXPECT_EQ(kept.v[static_cast<std::size_t>(i)], global.v[static_cast<std::size_t>(same - global.u.begin())]);
  }
}

TEST(PlaceRecognition, RecentPlacesAreNotLookedFor) {
  for (const bool by_age : {false, true}) {
    PlaceRecognitionOptions options = Drive::fewAndFast();
    options.candidates = 100;
    options.min_age = by_age ? 3.0 : 0.0;
    options.min_travel = by_age ? 0.0 : 30.0;
    Drive drive(0.0, options);
    double nearest = 1e9;
    for (const PlaceReport& report : drive.go(0, 60))
      for (const PlaceCandidate& candidate : report.candidates)
        nearest = std::min(nearest, drive.recognition.places().at(report.id).travelled -
                                        drive.recognition.places().at(candidate.place).travelled);
    EXPECT_NEAR(nearest, 31.5, 1.6) << "30 m, or 3 s at 10 m/s, and then the next key frame";
  }
}

TEST(PlaceRecognition, ALookalikeThatTheOdometryCannotHaveReachedIsNoLoop) {
  Drive drive;
  drive.go(0, 80);
  // The same view once more, 80 m on: the way between was straight and is known to a few metres.
  const StereoFeatures first = see(onCircle(0.0), kPeriod * (drive.pairs + 20));
  const CameraMotion motion{drive.T_odom_camera * onCircle(0.0).inverse() * onCircle(5.0), 1e-6 * Matrix6d::Identity(),
                            true};
  const auto report = drive.recognition.observe(first, motion);
  ASSERT_TRUE(report.has_value());
  EXPECT_TRUE(report->match.same);
  EXPECT_FALSE(report->same.has_value());
  EXPECT_EQ(report->reason, "the odometry cannot have drifted that far");
}

TEST(PlaceRecognition, AfterAnUnknownMotionAKnownPlaceSaysWhereItIs) {
  Drive drive;
  drive.go(0, 100);
  // Lost, carried back to metre 40, and started again from the last pose.
  const auto reports = drive.go(40, 60, false);
  EXPECT_GE(loops(reports), 1);
  EXPECT_LT(drive.error(), 0.3);
}

TEST(PlaceRecognition, RestoredPlacesLetANewSessionFindItself) {
  Drive mapping;
  mapping.go(0, 120);
  std::vector<Place> places = mapping.places();

  Drive later;
  later.recognition.restore(places, mapping.recognition.graph());
  const std::size_t known = later.recognition.places().size();
  EXPECT_EQ(known, mapping.recognition.places().size());
  later.T_odom_camera = Eigen::Isometry3d::Identity();  // the new odometry's own origin
  EXPECT_GE(loops(later.go(50, 70)), 1);
  EXPECT_LT(later.error(), 0.3) << "in the old map's frame";
  EXPECT_GT(later.recognition.places().size(), known);

  expectError([&] { later.recognition.restore(places, mapping.recognition.graph()); }, {"before"});
  PlaceRecognition fresh{PlaceRecognitionOptions()};
  places.pop_back();
  expectError([&] { fresh.restore(places, mapping.recognition.graph()); }, {"without a place"});
  EXPECT_TRUE(fresh.places().empty());
}

/// A drive in a map that was loaded and stays as it is.
Drive localisingIn(const Drive& mapping) {
  PlaceRecognitionOptions options = Drive::fewAndFast();
  options.localisation_only = true;
  Drive drive(0.001, options);
  drive.recognition.restore(mapping.places(), mapping.recognition.graph());
  drive.T_odom_camera = Eigen::Isometry3d::Identity();  // an origin of its own
  return drive;
}

TEST(PlaceRecognition, AMapThatIsOnlyLocalisedInStaysAsItIs) {
  Drive mapping;
  mapping.go(0, 150);
  Drive drive = localisingIn(mapping);
  const auto before = drive.recognition.graph().nodes();
  EXPECT_FALSE(drive.recognition.covariance()) << "nobody knows where it is";
  EXPECT_GE(loops(drive.go(20, 140)), 20);
  EXPECT_LT(drive.error(), 0.3);
  for (const auto& [id, T] : before) EXPECT_EQ(drive.recognition.graph().nodes().at(id).matrix(), T.matrix()) << id;
  EXPECT_EQ(drive.recognition.places().size(), before.size() + 20) << "the last part of its own way";
  ASSERT_TRUE(drive.recognition.covariance());
  const double deviation = std::sqrt(drive.recognition.covariance()->topLeftCorner<3, 3>().trace());
  EXPECT_GT(deviation, 1e-4);
  EXPECT_LT(deviation, 0.5);
}

/// Without a break it is known how far the odometry may have drifted since the last loop, or since the first place that
/// is kept, for as long as it goes on.
TEST(PlaceRecognition, BeyondTheMapTheDriftIsKnownSinceTheLastLoop) {
  Drive mapping;
  mapping.go(0, 60);
  for (const bool only_localised : {true, false}) {
    PlaceRecognitionOptions options = Drive::fewAndFast();
    options.localisation_only = only_localised;
    options.max_places = 40;
    Drive drive(0.001, options);
    drive.recognition.restore(mapping.places(), mapping.recognition.graph());
    ASSERT_GE(loops(drive.go(20, 60)), 5);
    const auto at_loop = drive.recognition.covariance();
    ASSERT_TRUE(at_loop);
    drive.go(60, 180);  // 40 more key frames
    const auto beyond = drive.recognition.covariance();
    ASSERT_TRUE(beyond) << only_localised;
    EXPECT_GT(beyond->trace(), 2.0 * at_loop->trace());
  }
}

TEST(PlaceRecognition, AHintSaysWhereItIsAndWhereNotToLook) {
  Drive mapping;
  mapping.go(0, 150);
  // What the odometry has as its origin is 50 m along the circle.
  const Eigen::Isometry3d true_hint = onCircle(50.0), wrong_hint = onCircle(120.0);
  Drive right = localisingIn(mapping), wrong = localisingIn(mapping);
  right.recognition.expect(Eigen::Translation3d(0.5, 0.0, 0.5) * true_hint, 5.0);
  const auto first = right.go(50, 53);
  ASSERT_EQ(first.size(), 1u);
  EXPECT_LT(right.error(), 0.8) << "as told, before anything was recognised";
  EXPECT_GT(right.error(), 0.6);
  EXPECT_GE(loops(right.go(53, 80)), 1);
  EXPECT_LT(right.error(), 0.3);

  wrong.recognition.expect(wrong_hint, 5.0);
  EXPECT_EQ(loops(wrong.go(50, 80)), 0);
  wrong.recognition.expect(wrong_hint, 200.0);
  EXPECT_GE(loops(wrong.go(80, 110)), 1) << "anywhere within the radius";
}

/// A file may say anything.
TEST(PlaceRecognition, PlacesWithWildNumbersAreNotTakenUp) {
  Drive mapping;
  mapping.go(0, 6);
  ASSERT_EQ(mapping.recognition.places().size(), 2u);
  const auto refusal = [&](int id, int segment) {
    std::vector<Place> places = mapping.places();
    places[1].id = id;
    places[1].segment = segment;
    std::map<int, Eigen::Isometry3d> nodes = {{0, Eigen::Isometry3d::Identity()}, {id, Eigen::Isometry3d::Identity()}};
    PlaceRecognition fresh{PlaceRecognitionOptions()};
    return errorOf([&] { fresh.restore(places, PoseGraph(nodes, {})); });
  };
  constexpr int kLargest = std::numeric_limits<int>::max();
  EXPECT_EQ(refusal(5, 0), "no error");
  expectWords(refusal(kLargest, 0), {"place 2147483647 of segment 0", "no numbers"});
  expectWords(refusal(1, kLargest), {"place 1 of segment 2147483647", "no numbers"});
  expectWords(refusal(-1, 0), {"place -1 of segment 0", "no numbers"});
  expectWords(refusal(2'000'000, 0), {"places 0 and 2000000"});
}

TEST(PlaceRecognition, AnotherRobotsSignatureAndRowsFindAPlace) {
  Drive one, other;
  one.go(0, 60);
  other.go(20, 24);
  const int asked = other.recognition.places().begin()->first;
  const auto found = one.recognition.find(other.recognition.signature(asked));
  ASSERT_FALSE(found.empty());
  const PlaceMatch match = one.recognition.verify(found[0].place, other.recognition.places().at(asked).features);
  EXPECT_TRUE(match.same) << match.reason;
}

TEST(PlaceRecognition, TheOldestPlacesGo) {
  PlaceRecognitionOptions options = Drive::fewAndFast();
  options.max_places = 20;
  Drive drive(0.0, options);
  drive.go(0, kAround);
  EXPECT_EQ(drive.recognition.places().size(), 20u);
  EXPECT_EQ(drive.recognition.graph().nodes().size(), 20u);
  EXPECT_GT(drive.recognition.bytes(), 20u * 100u * 64u);
  EXPECT_EQ(loops(drive.go(kAround, kAround + 20)), 0) << "the beginning is forgotten";
}

TEST(PlaceRecognition, OfRestoredPlacesNoMoreAreKeptThanOfOthers) {
  Drive mapping;
  mapping.go(0, 60);
  const std::vector<Place> places = mapping.places();
  PlaceRecognitionOptions options;
  options.max_places = 10;
  ASSERT_GT(places.size(), 15u);
  Drive later(0.0, options);
  later.recognition.restore(places, mapping.recognition.graph());
  later.go(60, 64);
  EXPECT_EQ(later.recognition.places().size(), 10u);
  EXPECT_EQ(later.recognition.graph().nodes().size(), 10u);
}

TEST(PlaceRecognition, RefusesOtherDescriptorsAndKeepsItsState) {
  Drive drive;
  drive.go(0, 10);
  const std::size_t known = drive.recognition.places().size();
  StereoFeatures other = see(onCircle(20.0), 100'000'000'000);
  other.descriptor = "brief";
  expectError([&] { drive.recognition.observe(other, {}); }, {"brief"});
  other.element_type = ElementType::kUint8;
  PlaceRecognition fresh{PlaceRecognitionOptions()};
  expectError([&] { fresh.observe(other, {}); }, {"uint8"});
  EXPECT_TRUE(fresh.places().empty());
  EXPECT_EQ(drive.recognition.places().size(), known);
}

}  // namespace sdvo::test_place_recognition
