#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "../said.hpp"
#include "../temporary_folder.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"

namespace sdvo::test_kitti_dataset {

namespace fs = std::filesystem;

const char kGreyCalibration[] =
    "P0: 700 0 60 0 0 710 40 0 0 0 1 0\n"
    "P1: 700 0 60 -350 0 710 40 0 0 0 1 0\n";

cv::Mat noise(int width, int height, int type, int seed) {
  cv::Mat image(height, width, type);
  cv::RNG rng(static_cast<std::uint64_t>(seed) + 1);
  rng.fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

/// sequences/07 with three grey pairs of 120x80 px; each test damages it.
class KittiDataset : public testing::Test {
 protected:
  void SetUp() override {
    writeImages("image_0", 3, CV_8UC1);
    writeImages("image_1", 3, CV_8UC1);
    writeText("calib.txt", kGreyCalibration);
    writeText("times.txt", "0.000000e+00\n1.036000e-01\n2.072000e-01\n");
  }

  void writeImages(const std::string& folder, int count, int type) {
    fs::create_directories(directory_ / folder);
    for (int i = 0; i < count; ++i) {
      cv::imwrite((directory_ / folder / ("00000" + std::to_string(i) + ".png")).string(), noise(120, 80, type, i));
    }
  }
  void writeText(const std::string& name, const std::string& text) { std::ofstream(directory_ / name) << text; }
  std::string path(const std::string& name) const { return (directory_ / name).string(); }
  KittiSequence open(KittiCameras cameras = KittiCameras::kAny) const {
    return KittiSequence(directory_.string(), cameras);
  }
  std::string openError(KittiCameras cameras = KittiCameras::kAny) const {
    return errorOf([&] { open(cameras); });
  }

  const TemporaryFolder folder_;
  const fs::path root_ = folder_.path(), directory_ = root_ / "sequences" / "07";
};

TEST_F(KittiDataset, GivesCameraStampsAndImages) {
  const KittiSequence sequence = open();
  EXPECT_EQ(sequence.size(), 3);
  const StereoCamera& camera = sequence.camera();
  EXPECT_DOUBLE_EQ(camera.fx, 700.0);
  EXPECT_DOUBLE_EQ(camera.fy, 710.0);
  EXPECT_DOUBLE_EQ(camera.cx, 60.0);
  EXPECT_DOUBLE_EQ(camera.cy, 40.0);
  EXPECT_DOUBLE_EQ(camera.baseline, 0.5);
  EXPECT_EQ(camera.width, 120);
  EXPECT_EQ(camera.height, 80);
  EXPECT_NO_THROW(camera.check());
  EXPECT_EQ(sequence.stamp(0), 0);
  EXPECT_EQ(sequence.stamp(1), 103600000);
  EXPECT_EQ(sequence.stamp(2), 207200000);

  cv::imwrite(path("image_1/000002.png"), cv::Mat(80, 120, CV_8UC1, cv::Scalar(77)));
  const ImagePair pair = sequence.load(2);
  EXPECT_EQ(cv::norm(pair.left, noise(120, 80, CV_8UC1, 2), cv::NORM_INF), 0.0);
  EXPECT_EQ(pair.right.type(), CV_8UC1);
  EXPECT_EQ(cv::norm(pair.right, cv::Mat(80, 120, CV_8UC1, cv::Scalar(77)), cv::NORM_INF), 0.0);
}

TEST_F(KittiDataset, BaselineOfTheColourPairIsADifference) {
  fs::remove_all(directory_ / "image_0");
  fs::remove_all(directory_ / "image_1");
  writeImages("image_2", 2, CV_8UC3);
  writeImages("image_3", 2, CV_8UC3);
  writeText("times.txt", "0.0\n0.1\n");
  writeText("calib.txt", std::string(kGreyCalibration) +
                             "P2: 700 0 60 42 0 710 40 0.2 0 0 1 0.003\nP3: 700 0 60 -308 0 710 40 2 0 0 1 0.003\n");
  const KittiSequence sequence = open();
  EXPECT_EQ(sequence.size(), 2);
  EXPECT_DOUBLE_EQ(sequence.camera().baseline, (42.0 + 308.0) / 700.0);
  EXPECT_EQ(sequence.load(1).left.type(), CV_8UC1);
}

TEST_F(KittiDataset, CamerasMayBeChosen) {
  writeImages("image_2", 3, CV_8UC3);
  writeImages("image_3", 3, CV_8UC3);
  writeText("calib.txt", std::string(kGreyCalibration) +
                             "P2: 600 0 60 42 0 710 40 0 0 0 1 0\nP3: 600 0 60 -308 0 710 40 0 0 0 1 0\n");
  EXPECT_EQ(open().size(), 3);
  EXPECT_DOUBLE_EQ(open(KittiCameras::kColour).camera().fx, 600.0);
  fs::remove_all(directory_ / "image_2");
  EXPECT_TRUE(contains(openError(KittiCameras::kColour), "no image_2"));
}

TEST_F(KittiDataset, BadCalibrationsAreNamed) {
  const std::string p0 = "P0: 700 0 60 0 0 710 40 0 0 0 1 0\n", name = path("calib.txt");
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
      {p0, {"file '" + name + "' has no line 'P1:'"}},
      {p0 + "P1: 700 0 60\n", {"line 2: expected 12 numbers after 'P1:', found 3"}},
      {"P0: 700 0 60 0 0 nan 40 0 0 0 1 0\n", {"line 1: 'nan' is not a finite number"}},
      {"P0: 0 0 60 0 0 710 40 0 0 0 1 0\nP1: 0 0 60 -350 0 710 40 0 0 0 1 0\n",
       {"focal lengths of P0 must be positive"}},
      {p0 + "P1: 700 0 65 -350 0 710 40 0 0 0 1 0\n", {"do not belong to a rectified pair"}},
      {p0 + "P1: 700 0 60 0 0 710 40 0 0 0 1 0\n", {"must be positive"}},
      {p0 + "P1: 700 0 60 350 0 710 40 0 0 0 1 0\n",
       {name, "-0.5", "P0 has fx = 700.000000, Tx = 0.000000", "P1 has fx = 700.000000, Tx = 350.000000"}}};
  for (const auto& [text, words] : cases) {
    writeText("calib.txt", text);
    expectWords(openError(), words);
  }
  fs::remove(name);
  expectWords(openError(), {"no '" + name, "--calibration"});
}

TEST_F(KittiDataset, BadTimesAreNamed) {
  const std::string name = path("times.txt");
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"0.0\n0.1\n", "file '" + name + "' has 2 times for 3 images"},
      {"0.0\n0.1\n0.2\n0.3\n", "'" + name + "' has more times than the 3 images"},
      {"0.0\n0.1\n0.1\n", "line 3: time 0.1 s is not later"},
      {"0.0\nabc\n0.1\n", "line 2: 'abc' is not a finite number"},
      {"0.0\n\n0.1\n", "line 2: a blank line"}};
  for (const auto& [text, words] : cases) {
    writeText("times.txt", text);
    expectWords(openError(), {words});
  }
  writeText("times.txt", "0.0\n0.1\n0.2\n\n  \n");
  EXPECT_EQ(open().size(), 3);
  fs::remove(name);
  expectWords(openError(), {"no file '" + name, "--rate"});
}

TEST_F(KittiDataset, StampsAreExactToTheNanosecond) {
  writeText("times.txt", "1403636584.763555584\n1403636584.763555585\n1403636584.813555456\n");
  const KittiSequence sequence = open();
  EXPECT_EQ(sequence.stamp(0), 1403636584763555584);
  EXPECT_EQ(sequence.stamp(1), 1403636584763555585);
}

TEST_F(KittiDataset, MissingDirectoriesAndImagesAreNamed) {
  expectError([] { KittiSequence("/nowhere/06"); }, {"'/nowhere/06' does not exist"});
  const auto expectMissing = [this](const std::string& removed, const std::vector<std::string>& words) {
    fs::remove_all(directory_ / removed);
    expectWords(openError(), words);
  };
  expectMissing("image_1/000001.png", {"image 1 is missing in '" + path("image_1"), "has 3 images", "has 2,"});
  expectMissing("image_1", {"has no image_1"});
  expectMissing("image_0", {"KITTI: image_0, image_1, calib.txt", "TartanAir: image_left"});
  SetUp();
  expectMissing("image_0/000002.png", {"image 2 is missing in '" + path("image_0")});
  fs::remove(directory_ / "image_1" / "000002.png");
  writeText("times.txt", "0.0\n0.1\n");
  EXPECT_EQ(open().size(), 2);
  expectMissing("image_0/000000.png", {"image 0 is missing in '" + path("image_0")});
  expectMissing("image_0/000001.png", {"has no numbered images"});
}

TEST_F(KittiDataset, TruncatedAndDamagedImagesAreRefused) {
  const std::string file = path("image_1/000001.png");
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  const KittiSequence sequence = open();
  ASSERT_NO_THROW(sequence.load(1));
  const auto errorWith = [&](const std::string& damaged) {
    std::ofstream(file, std::ios::binary) << damaged;
    return errorOf([&] { sequence.load(1); });
  };
  const std::string truncated = "image '" + file + "' is truncated: copy it again";
  for (const std::size_t size :
       {bytes.size() - 1, bytes.size() - 12, bytes.size() / 2, std::size_t{40}, std::size_t{8}})
    EXPECT_EQ(errorWith(bytes.substr(0, size)), truncated) << size;
  std::string longer_end = bytes, flipped = bytes;
  longer_end[bytes.size() - 12 + 3] = 1;  // the length of the last chunk, which is empty
  EXPECT_EQ(errorWith(longer_end), truncated);
  EXPECT_EQ(errorWith(""), "image '" + file + "' is empty: copy it again");
  flipped[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x55);
  expectWords(errorWith(flipped), {"'" + file + "' is damaged"});
}

TEST_F(KittiDataset, SizesMustAgree) {
  const std::string left = path("image_0/000001.png"), right = path("image_1/000001.png");
  cv::imwrite(right, noise(119, 80, CV_8UC1, 5));
  expectError([&] { open().load(1); }, {left + "' (120x80)", right + "' (119x80) differ in size"});
  cv::imwrite(left, noise(119, 80, CV_8UC1, 5));
  expectError([&] { open().load(1); }, {"is 119x80 but the first one"});
}

TEST_F(KittiDataset, FramesOutsideAreRefused) {
  const KittiSequence sequence = open();
  for (const int i : {-1, 3}) {
    EXPECT_THROW(sequence.load(i), std::out_of_range);
    EXPECT_THROW(sequence.stamp(i), std::out_of_range);
  }
}

TEST_F(KittiDataset, FindsPosesBesideTheSequence) {
  EXPECT_FALSE(findKittiPoses(directory_.string()));
  fs::create_directory(root_ / "poses");
  std::ofstream(root_ / "poses" / "07.txt") << "1 0 0 0 0 1 0 0 0 0 1 0\n";
  EXPECT_EQ(findKittiPoses(directory_.string()), (root_ / "poses" / "07.txt").string());
  EXPECT_EQ(findKittiPoses(directory_.string() + "/"), (root_ / "poses" / "07.txt").string());
  writeText("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  EXPECT_EQ(findKittiPoses(directory_.string()), path("poses.txt"));
}

/// Folders of other data sets, with the same three pairs.
class OtherFolders : public KittiDataset {
 protected:
  void lay(const std::string& left, const std::string& right, const std::string& before, const std::string& after,
           int first = 0, cv::Size size = {120, 80}) const {
    for (const std::string& folder : {left, right}) {
      fs::create_directories(other_ / folder);
      for (int i = first; i < first + 3; ++i)
        cv::imwrite((other_ / folder / (before + std::to_string(i) + after)).string(),
                    noise(size.width, size.height, CV_8UC3, i));
    }
  }
  void put(const std::string& name, const std::string& text) const { std::ofstream(other_ / name) << text; }
  KittiSequence openOther(const KittiSequence::Override& given = {}) const {
    return KittiSequence(other_.string(), KittiCameras::kAny, given);
  }

  const fs::path other_ = root_ / "2011_09_30" / "drive_0020_sync";
  const std::string raw_ =
      "calib_time: 09-Jan-2012 14:00:15\nS_rect_00: 1.2e+02 8e+01\nP_rect_00: 700 0 60 0 0 710 40 0 0 0 1 0\n"
      "P_rect_01: 700 0 60 -350 0 710 40 0 0 0 1 0\n",
                    times_ = "2011-09-30 11:50:40.1\n2011-09-30 11:50:40.200000001\n2011-09-30 11:50:40.3\n";
};

TEST_F(OtherFolders, OfKittiRaw) {
  lay("image_00/data", "image_01/data", "000000000", ".png");
  put("image_00/timestamps.txt", times_);
  put("../calib_cam_to_cam.txt", raw_);
  const KittiSequence sequence = openOther();
  EXPECT_EQ(sequence.size(), 3);
  EXPECT_DOUBLE_EQ(sequence.camera().baseline, 0.5);
  EXPECT_EQ(sequence.stamp(0), 1317383440100000000);
  EXPECT_EQ(sequence.stamp(1) - sequence.stamp(0), 100000001);
  put("../calib_cam_to_cam.txt", "S_rect_00: 1242 375\n" + raw_.substr(raw_.find("P_rect_00")));
  expectError([this] { openOther(); }, {"1242", "rectified", "_sync"});
}

TEST_F(OtherFolders, OfTartanAirWithARate) {
  lay("image_left", "image_right", "00000", "_left.png", 0, {640, 480});
  EXPECT_DOUBLE_EQ(openOther({{}, 0.0, 10.0}).camera().baseline, 0.25);
  EXPECT_EQ(openOther({{}, 0.0, 10.0}).stamp(2), 200000000);
  expectError([this] { openOther(); }, {"times", "--rate"});
  put("pose_left.txt", "0 0 0 0 0 0 1\n");
  EXPECT_EQ(findKittiPoses(other_.string()), (other_ / "pose_left.txt").string());
}

TEST_F(OtherFolders, OfJpegsFromAnyNumberOn) {
  lay("left", "right", "0000", ".jpg", 10);
  put("calib.txt", kGreyCalibration);
  put("times.txt", "0.0\n0.1\n0.3\n");
  const KittiSequence sequence = openOther();
  EXPECT_EQ(sequence.first(), 10);
  EXPECT_EQ(sequence.stamp(2), 300000000);
  EXPECT_EQ(sequence.load(2).left.type(), CV_8UC1);
  std::string all;  // the times of the whole drive
  for (int i = 0; i < 20; ++i) all += std::to_string(i) + ".5\n";
  put("times.txt", all);
  EXPECT_EQ(openOther().stamp(0), 10500000000);
  const std::string jpeg = (other_ / "right" / "000011.jpg").string();
  fs::resize_file(jpeg, fs::file_size(jpeg) / 2);
  expectError([&] { openOther().load(1); }, {jpeg, "truncated"});
  std::ofstream(jpeg) << "version https://git-lfs.github.com/spec/v1\n";
  expectError([&] { openOther().load(1); }, {jpeg, "git lfs pull"});
}

TEST_F(OtherFolders, OfRawImagesAreRectifiedByACalibration) {
  lay("left", "right", "0000", ".png", 10);
  const std::string lens = "  camera_model: pinhole\n  intrinsics: [50, 50, 60, 40]\n  resolution: [120, 80]\n"
                           "  distortion_model: radtan\n  distortion_coeffs: [-0.1, 0, 0, 0]\n";
  put("chain.yaml", "cam0:\n" + lens + "cam1:\n" + lens + "  T_cn_cnm1: [1, 0, 0, -0.1, 0, 1, 0, 0, 0, 0, 1, 0]\n");
  const KittiSequence sequence = openOther({{(other_ / "chain.yaml").string()}, 80.0, 10.0});
  EXPECT_NEAR(sequence.camera().baseline, 0.1, 1e-9);
  EXPECT_GT(cv::norm(sequence.load(0).left, sequence.loadRectified(0).left, cv::NORM_INF), 0.0);
}

TEST(KittiRealData, Sequence04) {
  const char* kitti = std::getenv("KITTI_DIR");
  if (kitti == nullptr) GTEST_SKIP() << "KITTI_DIR is not set: no real sequence is read";
  const std::string directory = std::string(kitti) + "/sequences/04";
  const KittiSequence sequence(directory);
  EXPECT_EQ(sequence.size(), 51);
  EXPECT_EQ(sequence.stamp(1), 104128400);
  EXPECT_NEAR(sequence.camera().baseline, 0.53715, 1e-4);  // the 54 cm that the data set's paper states
  const ImagePair pair = sequence.load(50);
  EXPECT_EQ(pair.left.size(), cv::Size(1226, 370));
  EXPECT_EQ(pair.right.type(), CV_8UC1);
  EXPECT_TRUE(findKittiPoses(directory));
}

}  // namespace sdvo::test_kitti_dataset
