#include <dynamic_reconfigure/ConfigDescription.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <gtest/gtest.h>
#include <ros/ros.h>

#include <atomic>
#include <stdexcept>
#include <thread>

#include "../../src/ros/node/params.hpp"
#include "../comma_locale.hpp"
#include "../said.hpp"

namespace sdvo::rostest_reconfigure_server {

enum class Kind { kA, kB };

const std::vector<std::string>& namesOf(Kind) {
  static const std::vector<std::string> names = {"a", "b"};
  return names;
}

struct Sample {
  bool flag = false;
  int low = 2, high = 8;
  double ratio = 0.5;
  Kind kind = Kind::kA;
  int size = 1;
  double share = 0.25;

  void describe(OptionList& list) {
    list.add("flag", flag, "a switch");
    list.add("low", low, {0, 10}, "px", "smaller than high");
    list.add("high", high, {0, 10}, "px", "larger than low");
    list.add("ratio", ratio, {0.0, 1.0}, "", "a number");
    list.add("kind", kind, "a choice");
    list.add("inner/size", size, {1, 5}, "", "of a component");
    list.add("inner/most/share", share, {0.0, 1.0}, "", "of a component of that");
  }
};

class ReconfigureServerTest : public ::testing::Test {
 protected:
  using Config = dynamic_reconfigure::Config;

  ReconfigureServerTest()
      : spinner_(2),
        server_(
            nh_, listOptions(sample_), [this] { apply(); }, listOptions(defaults_)) {
    spinner_.start();
  }
  ~ReconfigureServerTest() override { spinner_.stop(); }

  void apply() {
    EXPECT_EQ(++inside_, 1) << "two at a time";
    ros::WallDuration(pause_).sleep();
    ++applied_;
    --inside_;
    if (sample_.low > sample_.high) throw std::invalid_argument("low exceeds high");
  }

  /// Values by their names, one after the other.
  struct Values : Config {
    Values& set(const std::string& name, bool value) { return add(bools, name, value); }
    Values& set(const std::string& name, int value) { return add(ints, name, value); }
    Values& set(const std::string& name, double value) { return add(doubles, name, value); }
    Values& set(const std::string& name, const char* value) { return add(strs, name, value); }

   private:
    template <class Array, class Value>
    Values& add(Array& array, const std::string& name, const Value& value) {
      array.emplace_back();
      array.back().name = name, array.back().value = value;
      return *this;
    }
  };

  Config request(const Config& config) {
    dynamic_reconfigure::Reconfigure call;
    call.request.config = config;
    EXPECT_TRUE(ros::service::call("/reconfigure_server/set_parameters", call));
    return call.response.config;
  }

  /// They are set soon after the answer.
  template <class Value>
  bool becomes(const std::string& name, const Value& expected) {
    Value value{};
    for (int i = 0; i < 100 && !(nh_.getParam(name, value) && value == expected); ++i) ros::WallDuration(0.1).sleep();
    return value == expected;
  }

  /// Both are in the response and in the struct.
  void expectLimits(const Config& response, int low, int high) {
    EXPECT_EQ(sample_.low, low);
    EXPECT_EQ(sample_.high, high);
    ASSERT_EQ(response.ints.size(), 3u);
    EXPECT_EQ(response.ints[0].value, low);
    EXPECT_EQ(response.ints[1].value, high);
  }

  Sample sample_, defaults_;
  std::atomic<int> applied_{0}, inside_{0};
  double pause_ = 0.0;  // s
  ros::AsyncSpinner spinner_;
  ros::NodeHandle nh_{"/reconfigure_server"};
  ReconfigureServer server_;
};

TEST_F(ReconfigureServerTest, WhatWasSetIsOnTheParameterServerAndWhatWasRefusedIsNot) {
  for (const char* name : {"flag", "low", "ratio", "kind"}) nh_.deleteParam(name);
  request(Values().set("flag", true).set("low", 4).set("ratio", 2.0).set("kind", "b"));  // the ratio is clamped
  EXPECT_TRUE(becomes("kind", std::string("b"))) << "the last one";
  bool flag = false;
  int low = 0;
  double ratio = 0.0;
  EXPECT_TRUE(nh_.getParam("flag", flag) && flag);
  EXPECT_TRUE(nh_.getParam("low", low));
  EXPECT_EQ(low, 4);
  EXPECT_TRUE(nh_.getParam("ratio", ratio));
  EXPECT_EQ(ratio, 1.0);
  EXPECT_FALSE(nh_.hasParam("high")) << "nobody has set it";

  request(Values().set("low", 9));  // exceeds high
  request(Values().set("high", 10));
  EXPECT_TRUE(becomes("high", 10));
  EXPECT_TRUE(nh_.getParam("low", low));
  EXPECT_EQ(low, 4);
}

TEST_F(ReconfigureServerTest, SetsEachTypeAndAnswersWithTheWholeSet) {
  const Config response = request(Values().set("flag", true).set("low", 4).set("ratio", 0.1).set("kind", "b"));
  EXPECT_TRUE(sample_.flag);
  EXPECT_EQ(sample_.ratio, 0.1);
  EXPECT_EQ(sample_.kind, Kind::kB);
  expectLimits(response, 4, 8);
  EXPECT_TRUE(response.bools.at(0).value);
  EXPECT_EQ(response.doubles.at(0).value, 0.1);
  EXPECT_EQ(response.strs.at(0).value, "b");
  EXPECT_EQ(applied_, 1);
}

TEST_F(ReconfigureServerTest, ALocaleOfAnotherNodeletChangesNoNumber) {
  const CommaLocale set;
  EXPECT_EQ(request(Values().set("ratio", 0.75)).doubles.at(0).value, 0.75);
  EXPECT_TRUE(becomes("ratio", 0.75));
}

TEST_F(ReconfigureServerTest, TheSameValuesAreNoChange) {
  request(Values().set("low", 2).set("ratio", 0.5));
  request(Config());
  EXPECT_EQ(applied_, 0);
}

TEST_F(ReconfigureServerTest, NumbersOutOfRangeAreClamped) {
  expectLimits(request(Values().set("high", 99)), 2, 10);
}

TEST_F(ReconfigureServerTest, AWrongNameOrValueRefusesTheWholeSet) {
  expectLimits(request(Values().set("low", 5).set("kind", "c")), 2, 8);
  expectLimits(request(Values().set("low", 5).set("lower", 5)), 2, 8);
  expectLimits(request(Values().set("low", 5).set("ratio", std::numeric_limits<double>::quiet_NaN())), 2, 8);
  EXPECT_EQ(sample_.ratio, 0.5);
  EXPECT_EQ(applied_, 0);
}

TEST_F(ReconfigureServerTest, ASetThatDoesNotGoTogetherIsRefusedAndTheNextOneWorks) {
  Values values = Values().set("low", 9).set("flag", true);  // in its range, but above high
  expectLimits(request(values), 2, 8);
  EXPECT_FALSE(sample_.flag);
  expectLimits(request(values.set("high", 10)), 9, 10);
  EXPECT_TRUE(sample_.flag);
}

TEST_F(ReconfigureServerTest, RequestsAreTakenOverOneAfterTheOther) {
  pause_ = 0.02;
  const auto call = [this](int low) {
    for (int i = 0; i < 5; ++i) request(Values().set("low", low + i % 2));
  };
  std::thread first([&] { call(1); }), second([&] { call(3); });
  first.join();
  second.join();
  EXPECT_GE(applied_, 5);
}

TEST_F(ReconfigureServerTest, DescribesRangesAndDefaults) {
  const auto description =
      ros::topic::waitForMessage<dynamic_reconfigure::ConfigDescription>("/reconfigure_server/parameter_descriptions");
  ASSERT_TRUE(description);
  ASSERT_EQ(description->groups.size(), 3u);
  ASSERT_EQ(description->groups[0].parameters.size(), 5u);
  EXPECT_EQ(description->groups[0].parameters[1].description, "smaller than high [px]");
  EXPECT_EQ(description->max.ints.at(0).value, 10);
  EXPECT_EQ(description->dflt.ints.at(1).value, 8);
  EXPECT_TRUE(contains(description->groups[0].parameters[4].edit_method, "'value': 'b'"));
}

/// As rqt_reconfigure shows them: a tab for each component, and beside a value the one to go back to.
TEST_F(ReconfigureServerTest, ComponentsAreGroupsAndDefaultsStayWhatTheyAre) {
  const dynamic_reconfigure::ConfigDescription before =
      *ros::topic::waitForMessage<dynamic_reconfigure::ConfigDescription>("/reconfigure_server/parameter_descriptions");
  const auto namesOfGroups = [](const auto& groups) {
    std::vector<std::string> names;
    for (const auto& group : groups)
      names.push_back(group.name + " " + std::to_string(group.id) + " of " + std::to_string(group.parent));
    return names;
  };
  const std::vector<std::string> expected = {"Default 0 of 0", "inner 1 of 0", "inner/most 2 of 0"};
  EXPECT_EQ(namesOfGroups(before.groups), expected);
  EXPECT_EQ(before.groups[1].parameters.at(0).name, "inner/size");
  EXPECT_EQ(before.groups[2].parameters.at(0).name, "inner/most/share");
  for (const Config& config : {before.dflt, before.min, before.max, request(Config())})
    EXPECT_EQ(namesOfGroups(config.groups), expected);
  Sample loaded;
  loaded.high = 6;
  ReconfigureServer server(
      ros::NodeHandle("/loaded"), listOptions(loaded), [] {}, listOptions(defaults_));
  const auto description =
      ros::topic::waitForMessage<dynamic_reconfigure::ConfigDescription>("/loaded/parameter_descriptions");
  EXPECT_EQ(description->dflt.ints.at(1).value, 8);
  EXPECT_EQ(ros::topic::waitForMessage<Config>("/loaded/parameter_updates")->ints.at(1).value, 6);
}

}  // namespace sdvo::rostest_reconfigure_server
