#include <geometry_msgs/Pose.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <std_msgs/Header.h>
#include <sys/resource.h>
#include <topic_tools/shape_shifter.h>

#include <atomic>
#include <csignal>
#include <cstring>
#include <fstream>
#include <thread>

#include "../../src/ros/files/places_file.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "../temporary_folder.hpp"
#include "message_samples.hpp"

namespace sdvo::test_places_file {

namespace fs = std::filesystem;

class PlacesFile : public ::testing::Test {
 protected:
  PlacesFile() {
    std::map<int, Eigen::Isometry3d> nodes;
    std::vector<GraphEdge> edges;
    for (int id = 0; id < 3; ++id) {
      Place place;
      place.id = id;
      place.features = ros_conversions::someFeatures();
      place.features.stamp += id * 1000000000;
      places_.push_back(place);
      nodes[id] = Eigen::Isometry3d(Eigen::Translation3d(id, 0.0, 0.0));
      GraphEdge edge;
      edge.from = id - 1;
      edge.to = id;
      if (id > 0) edges.push_back(edge);
    }
    graph_ = PoseGraph(nodes, edges);
    stream_.frame_id = "left_optical";
  }

  void expectNoPartialFile() const {
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()), 1);
  }

  void save(const std::string& path, bool overwrite = false) {
    savePlaces({places_, graph_, stream_}, "/robot", "map", path, overwrite);
  }

  static void expectRefused(const std::string& path, const std::string& words) {
    EXPECT_THROW(loadPlaces(path), std::runtime_error) << path;
    expectError([&] { loadPlaces(path); }, {words});
  }

  const TemporaryFolder folder_;
  const std::string path_ = (fs::path(folder_.path()) / "places.bag").string();
  std::vector<Place> places_;
  PoseGraph graph_;
  ros_conversions::FeatureStream stream_;
};

TEST_F(PlacesFile, WhatIsSavedIsLoaded) {
  save(path_);
  expectNoPartialFile();
  const SavedPlaces loaded = loadPlaces(path_);
  ASSERT_EQ(loaded.places.size(), 3u);
  EXPECT_EQ(loaded.places[2].id, 2);
  EXPECT_EQ(loaded.places[2].features.stamp, places_[2].features.stamp);
  EXPECT_EQ(loaded.graph.nodes().at(2).translation().x(), 2.0);
  EXPECT_EQ(loaded.graph.edges().size(), 2u);
  EXPECT_EQ(loaded.stream.frame_id, "left_optical");
}

/// Writes the places of a file as 0.1.0 did: they end where right_delay and noise are now.
void writeOld(const std::string& path, const std::string& old, const float (&added)[2]) {
  rosbag::Bag now(path), before(old, rosbag::bagmode::Write);
  for (const rosbag::MessageInstance& message : rosbag::View(now)) {
    std::vector<std::uint8_t> bytes(message.size());
    ros::serialization::OStream out(bytes.data(), message.size());
    message.write(out);
    const bool is_place = message.getTopic() == "place";
    if (is_place) {
      EXPECT_EQ(std::memcmp(bytes.data() + bytes.size() - sizeof added, added, sizeof added), 0);
    }
    topic_tools::ShapeShifter shifter;
    shifter.morph(is_place ? "d90a2505b9172820b06c0867769c61b0" : message.getMD5Sum(), message.getDataType(),
                  message.getMessageDefinition(), "");
    ros::serialization::IStream in(bytes.data(),
                                   message.size() - static_cast<std::uint32_t>(is_place ? sizeof added : 0));
    shifter.read(in);
    before.write(message.getTopic(), message.getTime(), shifter);
  }
}

TEST_F(PlacesFile, PlacesOfTheFirstVersionAreLoadedUnlessTheirBitsHaveAnotherMeaning) {
  const float added[] = {0.25f, 2.f};
  const std::string old = path_ + ".old";
  for (const char* descriptor : {"brief", "freak"}) {
    for (Place& place : places_) {
      place.features.descriptor = descriptor;
      place.features.right_delay = added[0], place.features.report.noise = added[1];
    }
    save(path_, true);
    writeOld(path_, old, added);
    if (descriptor == std::string("brief"))
      EXPECT_EQ(loadPlaces(old).places.size(), 3u);
    else
      expectRefused(old, "drive there again");
  }
}

TEST_F(PlacesFile, PathsThatCannotBeWrittenAreRefused) {
  expectError([&] { save("places.bag"); }, {"'places.bag': the path must be absolute"});
  expectError([&] { save(folder_.path()); }, {"it is no regular file"});
  expectError([&] { save(path_ + "/places.bag"); }, {"cannot be written"});
}

TEST_F(PlacesFile, ReplacesItsOwnFilesAlone) {
  std::ofstream(path_).flush();
  EXPECT_NO_THROW(save(path_)) << "nothing is lost";
  EXPECT_NO_THROW(save(path_));
  std::ofstream(path_) << "precious";
  EXPECT_TRUE(contains(errorOf([&] { save(path_); }), "'" + path_ + "' is no file of save_places"));
  EXPECT_EQ(fs::file_size(path_), 8u);
  rosbag::Bag bag(path_, rosbag::bagmode::Write);  // of another recorder
  bag.write("/stereo/map_graph", ros::Time(1), stereo_descriptor_vo::MapGraph());
  bag.close();
  EXPECT_TRUE(contains(errorOf([&] { save(path_); }), "is no file of save_places"));
  EXPECT_NO_THROW(save(path_, true));
  EXPECT_EQ(loadPlaces(path_).places.size(), 3u);
}

/// As on a full disk. rosbag tries to write the end of a bag once more when it is destroyed.
TEST_F(PlacesFile, WhereThereIsNoRoomTheProcessGoesOn) {
  save(path_);
  const auto size = fs::file_size(path_);
  ASSERT_GT(size, 8192u);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto signal_before = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{8192, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string error = errorOf([&] { save(path_); });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, signal_before);
  EXPECT_TRUE(contains(error, "cannot be written")) << error;
  expectNoPartialFile();
  EXPECT_EQ(fs::file_size(path_), size);
  EXPECT_EQ(loadPlaces(path_).places.size(), 3u);
}

TEST_F(PlacesFile, WhatCannotBeWrittenToItsEndLeavesTheFileOfBefore) {
  save(path_);
  places_[2].features.stamp = 0;
  EXPECT_TRUE(contains(errorOf([&] { save(path_); }), "cannot be written"));
  expectNoPartialFile();
  EXPECT_EQ(loadPlaces(path_).places.size(), 3u);
}

TEST_F(PlacesFile, FilesThatAreNoneAreRefused) {
  expectRefused("places.bag", "the path must be absolute");
  expectRefused(path_, "there is no such file");
  expectRefused(folder_.path(), "there is no such file");
  std::ofstream(path_) << "no bag";
  expectRefused(path_, path_);
  rosbag::Bag(path_, rosbag::bagmode::Write).close();
  expectRefused(path_, "it holds no places");
  for (const auto& [compression, words] : {std::pair(rosbag::compression::Uncompressed, "another type or version"),
                                           {rosbag::compression::BZ2, "rosbag decompress"}}) {
    rosbag::Bag bag(path_, rosbag::bagmode::Write);
    bag.setCompression(compression);
    bag.write("place", ros::Time(1), std_msgs::Header());
    bag.close();
    expectRefused(path_, words);
  }
  save(path_, true);
  fs::resize_file(path_, fs::file_size(path_) / 2);
  expectRefused(path_, "");
}

TEST_F(PlacesFile, PlacesOfTwoCamerasAreRefused) {
  places_[1].features.camera.fx *= 1.1;
  save(path_);
  expectRefused(path_, "its places 0 and 1 are of different cameras");
}

/// As cp writes it: from its beginning on, in place. A page of a map of it that is not there any more ends the process.
TEST_F(PlacesFile, AFileMayChangeWhileItIsRead) {
  for (int id = 3; id < 30; ++id) places_.push_back(places_[0]);
  save(path_);
  std::ostringstream whole;
  whole << std::ifstream(path_, std::ios::binary).rdbuf();
  std::atomic<bool> ends{false};
  std::thread writer([&] {
    while (!ends) {
      fs::resize_file(path_, 0);
      std::ofstream(path_, std::ios::binary) << whole.str();
    }
  });
  for (int i = 0; i < 2000; ++i) {
    const std::string error = errorOf([&] { loadPlaces(path_); });
    EXPECT_TRUE(error == "no error" || contains(error, "it ends early") || contains(error, "it is empty") ||
                contains(error, "no bag"))
        << error;
  }
  ends = true;
  writer.join();
}

/// Whatever length, count or offset in it is wrong: a record's, a chunk's, an array's within a message.
TEST_F(PlacesFile, AFileThatAnnouncesMuchTakesLittle) {
  places_.resize(1);
  graph_ = PoseGraph({{0, Eigen::Isometry3d::Identity()}}, {});
  save(path_);
  std::stringstream text;
  text << std::ifstream(path_, std::ios::binary).rdbuf();
  const std::string good = text.str();
  const auto peak = [] {  // B, of the process so far
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return 1024L * usage.ru_maxrss;
  };
  const long before = peak();
  for (const std::uint32_t announced : {900u << 20, 0xfffffff0u, 1u << 30}) {
    for (std::size_t at = 13; at + sizeof announced <= good.size(); ++at) {
      std::uint32_t length = 0;
      std::memcpy(&length, &good[at], sizeof length);
      if (length == 0 || at + sizeof length + length > good.size()) continue;  // it is none
      std::string bad = good;
      std::memcpy(&bad[at], &announced, sizeof announced);
      std::ofstream(path_, std::ios::binary) << bad;
      errorOf([&] { loadPlaces(path_); });
      ASSERT_LT(peak() - before, 64 << 20) << announced << " at byte " << at;
    }
  }
}

}  // namespace sdvo::test_places_file
