#include <gtest/gtest.h>

#include <set>

#include "../../src/front_end/feature_detector.hpp"
#include "../../src/front_end/stereo_matcher.hpp"
#include "../../src/map/local_map.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace sdvo::test_options {

/// One option of every type, two of them with the same last name.
struct Inner {
  int count = 5;
  double width = 1.5;

  void describe(OptionList& list) {
    list.add("count", count, {1, 10}, "", "how many");
    list.add("width", width, {0.5, 2.0}, "m", "how wide");
  }
};

enum class Colour { kRed, kGreen };

const std::vector<std::string>& namesOf(Colour) {
  static const std::vector<std::string> names = {"red", "green"};
  return names;
}

struct Outer {
  Inner near_side;
  Inner far_side;
  bool on = true;
  Colour colour = Colour::kRed;
  double height = 3.0;

  void describe(OptionList& list) {
    list.group("near_side", near_side);
    list.group("far_side", far_side);
    list.add("on", on, "whether");
    list.add("colour", colour, "which");
    list.add("height", height, {0.0, 10.0}, "m", "how high");
  }
};

template <class Options>
void expectUsable(Options options) {
  EXPECT_NO_THROW(checked(options));
  std::set<std::string> names;
  for (const Option& option : listOptions(options)) {
    EXPECT_TRUE(names.insert(option.name).second) << option.name << " is listed twice";
    EXPECT_FALSE(option.meaning.empty()) << option.name << " has no meaning";
  }
  EXPECT_FALSE(names.empty());
}

TEST(Options, DefaultsOfAllComponentsAreInRange) {
  expectUsable(FeatureExtractorOptions());
  expectUsable(VisualOdometryOptions());
}

TEST(Options, PathsFollowTheComposition) {
  Outer outer;
  const std::vector<Option> options = listOptions(outer);
  std::vector<std::string> names;
  for (const Option& option : options) names.push_back(option.name);
  EXPECT_EQ(names, (std::vector<std::string>{"near_side/count", "near_side/width", "far_side/count", "far_side/width",
                                             "on", "colour", "height"}));
}

TEST(Options, EndsOfTheRangeAreInsideAndNeighboursAreNot) {
  Outer outer;
  outer.near_side.width = 0.5;
  outer.far_side.width = 2.0;
  EXPECT_NO_THROW(checked(outer));
  using Limits = std::numeric_limits<double>;
  for (const double bad : {std::nextafter(0.5, 0.0), Limits::quiet_NaN(), Limits::infinity()}) {
    outer.near_side.width = bad;
    EXPECT_THROW(checked(outer), std::invalid_argument) << bad;
  }
}

/// Whoever is made of options checks them; a composition names the full path.
template <class Component, class Options>
void expectChecked(Options options, const std::string& words) {
  expectError([&] { Component{options}; }, {words});
}

TEST(Options, ComponentsRefuseWhatIsOutOfRange) {
  FeatureExtractorOptions extractor;
  extractor.detector.max_features = 0;
  expectChecked<FeatureExtractor>(extractor, "detector/max_features");
  expectChecked<FeatureDetector>(extractor.detector, "max_features");
  StereoMatcherOptions stereo;
  stereo.max_epipolar_residual = 0.0;
  expectChecked<StereoMatcher>(stereo, "max_epipolar_residual");
  VisualOdometryOptions odometry;
  odometry.map.keyframes = 0;
  expectChecked<VisualOdometry>(odometry, "map/keyframes");
  expectChecked<LocalMap>(odometry.map, "keyframes");
}

/// What fields demand of each other is checked with the whole set, wherever the component stands in it.
TEST(Options, CheckedLooksAtTheFieldsTogether) {
  FeatureExtractorOptions options;
  options.size_curve.min_size = 100.0;  // above max_size; each of them is in its range
  expectError([&] { checked(options); }, {"size_curve/", "min_size", "max_size"});
  options.size_curve.max_size = 100.0;
  EXPECT_NO_THROW(checked(options));
  options.stereo.min_disparity = 20.0;
  options.stereo.epipolar.max_disparity = 10.0;
  expectError([&] { checked(options); }, {"stereo/min_disparity"});
}

TEST(Options, EnumsAreTextOutsideAndKnowTheirNames) {
  Outer outer;
  std::vector<Option> options = listOptions(outer);
  const Option& colour = options[5];
  EXPECT_TRUE(colour.isText());
  EXPECT_EQ(colour.choices, (std::vector<std::string>{"red", "green"}));
  EXPECT_EQ(colour.text(), "red");
  outer.colour = Colour::kGreen;
  EXPECT_EQ(colour.text(), "green");
  EXPECT_EQ(nameOf(Colour::kGreen), "green");
  EXPECT_EQ(valueOf<Colour>("red"), Colour::kRed);
  EXPECT_EQ(errorOf([] { valueOf<Colour>("blue"); }), "'blue' is none of: red, green");
}

/// Recorded hashes name configurations in the documents; a new way to hold an option must not change them.
TEST(Options, HashOfTheTextIsTheSameForEver) {
  EXPECT_EQ(hashOptions({}), "cbf29ce484222325");
  Outer outer;
  EXPECT_EQ(hashOptions(listOptions(outer)), "027afa27c9d5d09a");
}

TEST(Options, SetBySuffixOrFullPath) {
  Outer outer;
  std::vector<Option> options = listOptions(outer);
  setOption(options, "near_side/count", "7");
  setOption(options, "height", "2.5");
  setOption(options, "on", "false");
  setOption(options, "colour", "green");
  EXPECT_EQ(outer.near_side.count, 7);
  EXPECT_EQ(outer.far_side.count, 5);
  EXPECT_EQ(outer.height, 2.5);
  EXPECT_FALSE(outer.on);
  EXPECT_EQ(outer.colour, Colour::kGreen);

  FeatureExtractorOptions extractor;
  std::vector<Option> real = listOptions(extractor);
  setOption(real, "max_disparity", "50");
  EXPECT_EQ(extractor.stereo.epipolar.max_disparity, 50.0);
}

TEST(Options, SetRefusesAmbiguousAndUnknownNames) {
  Outer outer;
  std::vector<Option> options = listOptions(outer);
  expectError([&] { setOption(options, "count", "7"); }, {"ambiguous", "near_side/count"});
  EXPECT_EQ(outer.near_side.count, 5);
  EXPECT_EQ(outer.far_side.count, 5);
  // A part of a name is not a name.
  for (const std::string unknown : {"depth", "eight", "side/count", ""})
    expectError([&] { setOption(options, unknown, "1"); }, {unknown});
}

TEST(Options, SetRefusesTextOfAnotherTypeAndValuesOutOfRange) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> bad = {
      {"near_side/count", {"3.5", "", "99999999999", "0"}},
      {"height", {"tall", "1,5", "nan", "-1"}},
      {"on", {"perhaps"}},
      {"colour", {"blue"}}};
  for (const auto& [name, texts] : bad)
    for (const std::string& text : texts) {
      Outer outer;
      std::vector<Option> options = listOptions(outer);
      const std::string before = hashOptions(options);
      expectError([&, n = name] { setOption(options, n, text); }, {name, text});
      EXPECT_EQ(hashOptions(options), before) << name << " took '" << text << "'";
    }
}

TEST(Options, TextIsReadBackExactly) {
  for (const double value : {0.1, 1.0 / 3.0, 0.72, 9.87654321e-5, std::nextafter(2.5, 3.0)}) {
    Outer source, target;
    source.height = value;
    std::vector<Option> from = listOptions(source), to = listOptions(target);
    setOption(to, "height", from.back().text());
    EXPECT_EQ(target.height, value) << "written as " << from.back().text();
  }
}

TEST(Options, ClampMovesNumbersToTheNearestEnd) {
  Outer outer;
  outer.near_side.count = 99;
  outer.near_side.width = -1.0;
  outer.far_side.count = -3;
  outer.far_side.width = std::numeric_limits<double>::quiet_NaN();
  std::vector<Option> options = listOptions(outer);
  std::set<std::string> changed;
  for (Option& option : options)
    if (option.clamp()) changed.insert(option.name);
  EXPECT_EQ(changed, (std::set<std::string>{"near_side/count", "near_side/width", "far_side/count", "far_side/width"}));
  EXPECT_EQ(outer.near_side.count, 10);
  EXPECT_EQ(outer.near_side.width, 0.5);
  EXPECT_EQ(outer.far_side.count, 1);
  EXPECT_EQ(outer.height, 3.0);
  EXPECT_NO_THROW(checked(outer));
  for (Option& option : options) EXPECT_FALSE(option.clamp()) << option.name;
}

TEST(Options, HashTellsOptionsApart) {
  std::set<std::string> hashes;
  const std::vector<std::function<void(Outer&)>> changes = {[](Outer&) {},
                                                            [](Outer& o) { o.near_side.count = 6; },
                                                            [](Outer& o) { o.far_side.count = 6; },
                                                            [](Outer& o) { o.on = false; },
                                                            [](Outer& o) { o.colour = Colour::kGreen; },
                                                            [](Outer& o) { o.height = 3.0 + 1e-12; },
                                                            [](Outer& o) { o.height = std::nextafter(3.0, 4.0); }};
  for (const auto& change : changes) {
    Outer outer, same;
    change(outer), change(same);
    EXPECT_TRUE(hashes.insert(hashOptions(listOptions(outer))).second) << "options differ, their hashes do not";
    EXPECT_EQ(hashes.count(hashOptions(listOptions(same))), 1u);
  }
}

}  // namespace sdvo::test_options
