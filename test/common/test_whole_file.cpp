#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <set>
#include <sstream>

#include "../../src/common/whole_file.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "../temporary_folder.hpp"

namespace sdvo::test_whole_file {

std::vector<std::string> synchronised;  ///< in the order of the calls, and with what had been written by then

}  // namespace sdvo::test_whole_file

/// In the place of libc's.
extern "C" int fsync(int file) {
  char name[4096] = {};
  const std::string link = "/proc/self/fd/" + std::to_string(file);
  if (::readlink(link.c_str(), name, sizeof name - 1) < 0) return -1;
  struct stat status {};
  ::fstat(file, &status);
  sdvo::test_whole_file::synchronised.push_back(S_ISDIR(status.st_mode) ? name
                                                                        : std::to_string(status.st_size) + " bytes");
  return 0;
}

namespace sdvo {
namespace test_whole_file {

namespace fs = std::filesystem;

class WholeFile : public ::testing::Test {
 protected:
  static void save(const fs::path& path, const std::string& text) {
    writeWhole(path.string(), [&](const std::string& partial) { std::ofstream(partial) << text; });
  }

  static std::string contentOf(const fs::path& path) {
    std::stringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }

  std::set<std::string> names() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_.path())) names.insert(entry.path().filename().string());
    return names;
  }

  const TemporaryFolder folder_;
  const fs::path path_ = folder_.path() / "map.bag";
};

TEST_F(WholeFile, IsOnTheDiskBeforeAndAfterItsNameIsThere) {
  synchronised.clear();
  save(path_, "twelve bytes");
  EXPECT_EQ(synchronised, (std::vector<std::string>{"12 bytes", fs::canonical(folder_.path()).string()}));
  EXPECT_EQ(names(), std::set<std::string>{"map.bag"});
}

TEST_F(WholeFile, ALinkStaysAndLeadsToTheNewFile) {
  fs::create_directory(folder_.path() / "disk");
  for (const fs::path target : {"disk/map.bag", "disk/not_yet.bag"}) {
    if (target == "disk/map.bag") std::ofstream(folder_.path() / target) << "old";
    fs::remove(folder_.path() / "first");
    fs::remove(path_);
    fs::create_symlink(folder_.path() / target, folder_.path() / "first");
    fs::create_symlink("first", path_);  // a relative one to an absolute one
    save(path_, "new");
    EXPECT_TRUE(fs::is_symlink(path_)) << target;
    EXPECT_TRUE(fs::is_symlink(folder_.path() / "first")) << target;
    EXPECT_EQ(contentOf(folder_.path() / target), "new");
  }
  EXPECT_EQ(names(), (std::set<std::string>{"disk", "first", "map.bag"}));
}

TEST_F(WholeFile, ALinkToItselfIsRefused) {
  fs::create_symlink("map.bag", path_);
  const std::string error = errorOf([&] { save(path_, "new"); });
  EXPECT_TRUE(contains(error, "Too many levels of symbolic links")) << error;
  EXPECT_TRUE(fs::is_symlink(path_));
}

TEST_F(WholeFile, AFilePlantedBesideItIsNotWrittenTo) {
  std::ofstream(folder_.path() / "others") << "precious";
  fs::create_symlink("others", path_.string() + ".partial");
  save(path_, "new");
  EXPECT_EQ(contentOf(folder_.path() / "others"), "precious");
  EXPECT_EQ(contentOf(path_), "new");
}

TEST_F(WholeFile, TwoSaversDoNotMixTheirText) {
  writeWhole(path_.string(), [&](const std::string& outer) {
    std::ofstream(outer) << "outer, begun first";
    save(path_, "inner");
    EXPECT_EQ(contentOf(path_), "inner");
    EXPECT_EQ(contentOf(outer), "outer, begun first");
  });
  EXPECT_EQ(contentOf(path_), "outer, begun first");
  EXPECT_EQ(names(), std::set<std::string>{"map.bag"});
}

TEST_F(WholeFile, WhatAKilledProcessLeftGoesWithTheNext) {
  std::ofstream(path_.string() + ".partial-17") << "half";
  std::ofstream(path_.string() + ".part") << "precious";
  save(path_, "new");
  EXPECT_EQ(names(), (std::set<std::string>{"map.bag", "map.bag.part"}));
}

TEST_F(WholeFile, HasThePermissionsOfTheFileBeforeOrOfAnyNewFile) {
  save(path_, "new");
  std::ofstream(folder_.path() / "any") << "new";
  EXPECT_EQ(fs::status(path_).permissions(), fs::status(folder_.path() / "any").permissions());
  fs::permissions(path_, fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  save(path_, "newer");
  EXPECT_EQ(fs::status(path_).permissions(), fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
}

TEST_F(WholeFile, WhoCannotWriteLeavesNothing) {
  std::ofstream(path_) << "old";
  const std::string error = errorOf([&] {
    writeWhole(path_.string(), [](const std::string& partial) {
      std::ofstream(partial) << "half";
      throw std::runtime_error("no room");
    });
  });
  EXPECT_EQ(error, "'" + path_.string() + "': cannot be written: no room");
  EXPECT_EQ(contentOf(path_), "old");
  EXPECT_EQ(names(), std::set<std::string>{"map.bag"});
}

}  // namespace test_whole_file
}  // namespace sdvo
