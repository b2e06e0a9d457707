#include <gtest/gtest.h>
#include <ros/ros.h>

#include <tuple>

#include "../../src/ros/node/params.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::rostest_params {

enum class Kind { kA, kB };

const std::vector<std::string>& namesOf(Kind) {
  static const std::vector<std::string> names = {"a", "b"};
  return names;
}

struct Inner {
  double ratio = 0.5;

  void describe(OptionList& list) { list.add("ratio", ratio, {0.0, 1.0}, "", "a number"); }
};

struct Sample {
  bool flag = false;
  int count = 3;
  Kind kind = Kind::kA;
  Inner inner;

  void describe(OptionList& list) {
    list.add("flag", flag, "a switch");
    list.add("count", count, {1, 10}, "", "a whole number");
    list.add("kind", kind, "a choice");
    list.group("inner", inner);
  }
};

class LoadParams : public ::testing::Test {
 protected:
  ~LoadParams() override { nh_.deleteParam(nh_.getNamespace()); }

  ros::NodeHandle nh_{"/load_params"};
};

TEST_F(LoadParams, ReadsEachTypeFromItsPath) {
  nh_.setParam("flag", true);
  nh_.setParam("count", 10);  // the end of the range
  nh_.setParam("kind", "b");
  nh_.setParam("inner/ratio", 0.25);
  Sample sample;
  EXPECT_EQ(loadParams(nh_, sample), std::vector<std::string>{});
  EXPECT_TRUE(sample.flag);
  EXPECT_EQ(sample.count, 10);
  EXPECT_EQ(sample.kind, Kind::kB);
  EXPECT_EQ(sample.inner.ratio, 0.25);
}

TEST_F(LoadParams, TakesTheSameValueOfAnotherType) {
  nh_.setParam("flag", 1);
  nh_.setParam("count", 5.0);
  nh_.setParam("inner/ratio", "5e-1");  // text, by YAML 1.1
  Sample sample;
  EXPECT_EQ(loadParams(nh_, sample), std::vector<std::string>{});
  EXPECT_TRUE(sample.flag);
  EXPECT_EQ(sample.count, 5);
  EXPECT_EQ(sample.inner.ratio, 0.5);
  nh_.setParam("flag", "false");
  nh_.setParam("count", "1e1");
  nh_.setParam("inner/ratio", 1);
  loadParams(nh_, sample);
  EXPECT_EQ(sample.inner.ratio, 1.0);
  EXPECT_FALSE(sample.flag);
  EXPECT_EQ(sample.count, 10);
}

TEST_F(LoadParams, RefusesWrongValuesByNameAndValue) {
  using XmlRpc::XmlRpcValue;
  XmlRpcValue list;
  list[0] = 0.5;
  const std::vector<std::tuple<std::string, XmlRpcValue, std::string>> cases = {
      {"count", 11, "count = 11 is outside [1, 10]"},
      {"count", 0, "count = 0 is outside [1, 10]"},
      {"inner/ratio", -0.5, "inner/ratio = -0.5 is outside [0, 1]"},
      {"kind", "c", "kind = 'c' is none of: a, b"},
      {"flag", "perhaps", "flag = 'perhaps' is neither true nor false"},
      {"count", 2.5, "count = '2.5' is not a whole number"},
      {"count", 1e300, "count = '1.0000000000000001e+300' is not a whole number"},
      {"kind", 5, "kind = '5' is none of: a, b"},
      {"inner/ratio", "half", "inner/ratio = 'half' is not a number"},
      {"inner/ratio", list, "inner/ratio is a list or a block: one value is expected"}};
  for (const auto& [name, value, words] : cases) {
    nh_.setParam(name, value);
    Sample sample;
    EXPECT_THROW(loadParams(nh_, sample), std::invalid_argument);
    EXPECT_EQ(errorOf([&] { loadParams(nh_, sample); }), "parameter /load_params/" + words);
    nh_.deleteParam(name);
  }
}

TEST_F(LoadParams, TheServerShowsWhatIsInUseAndWhatIsAbsentKeepsItsValue) {
  nh_.setParam("count", 5);
  Sample sample;
  sample.inner.ratio = 0.75;
  EXPECT_EQ(loadParams(nh_, sample), std::vector<std::string>{});
  EXPECT_EQ(sample.inner.ratio, 0.75);
  bool flag = true;
  int count = 0;
  double ratio = 0.0;
  std::string kind;
  EXPECT_TRUE(nh_.getParam("flag", flag) && !flag);
  EXPECT_TRUE(nh_.getParam("count", count) && count == 5);
  EXPECT_TRUE(nh_.getParam("inner/ratio", ratio) && ratio == 0.75);
  EXPECT_TRUE(nh_.getParam("kind", kind) && kind == "a");
}

TEST_F(LoadParams, NamesWhatIsNoOption) {
  nh_.setParam("cuont", 5);
  nh_.setParam("inner/rate", 5);
  nh_.setParam("image_transport", "raw");
  nh_.setParam("input_topics", "/left/image_rect");
  nh_.setParam("left_image/compressed/mode", "color");
  nh_.setParam("right_image/compressed/mode", "color");
  ros::NodeHandle("/load_params_of_another").setParam("other", 1);
  Sample sample;
  std::vector<std::string> unknown = loadParams(nh_, sample);
  std::sort(unknown.begin(), unknown.end());
  EXPECT_EQ(unknown, (std::vector<std::string>{"/load_params/cuont", "/load_params/inner/rate"}));
}

}  // namespace sdvo::rostest_params
