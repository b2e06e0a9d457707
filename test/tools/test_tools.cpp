#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <stereo_descriptor_vo/VoInfo.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <tf2_msgs/TFMessage.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "../temporary_folder.hpp"

namespace sdvo::test_tools {

namespace fs = std::filesystem;

struct Outcome {
  int exit_code;  ///< -1: ended by a signal
  std::string out, err;
};

std::string readText(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::vector<std::string> linesOf(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::vector<double> numbersOf(const std::string& line) {
  std::istringstream stream(line);
  return {std::istream_iterator<double>(stream), std::istream_iterator<double>()};
}

std::vector<std::string> cellsOf(const std::string& row) {
  std::istringstream stream(row);
  std::vector<std::string> cells;
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  return cells;
}

std::vector<std::string> errorLines(const Outcome& outcome) {
  std::vector<std::string> errors;
  for (const std::string& line : linesOf(outcome.err))
    if (line.rfind("error:", 0) == 0) errors.push_back(line);
  return errors;
}

/// What the script of a page draws; nothing of it may come from elsewhere.
std::string readPage(const fs::path& page) {
  const std::string html = readText(page), begin = "<script type='application/json' id='data'>";
  EXPECT_EQ(html.rfind("<!doctype html>", 0), 0u);
  EXPECT_LT(html.size(), 2000000u);
  for (const char* elsewhere : {"http", "src='/", "url(", "@import", "<script src", "import(", "fetch("})
    EXPECT_FALSE(contains(html, elsewhere)) << elsewhere;
  const std::size_t data = html.find(begin) + begin.size();
  const std::string json = html.substr(data, html.find("</script>") - data);
  // Numbers that are none are null.
  EXPECT_FALSE(contains(json.substr(0, json.find("\"pictures\"")), "nan"));
  EXPECT_TRUE(YAML::Load(json).IsMap());
  return json;
}

/// The built tools on a small drive towards a textured wall.
class Tools : public testing::Test {
 protected:
  static constexpr int kPairs = 4;
  static constexpr double kStep = 0.2;      // m forward in each pair
  static constexpr double kWall = 8.0;      // m ahead of the first camera
  static constexpr double kBaseline = 0.5;  // m

  void SetUp() override {
    const StereoCamera camera{300.0, 300.0, 160.0, 120.0, kBaseline, 320, 240};
    const synthetic::Texture texture(5, 0.15, 4.0);
    for (int side = 0; side < 2; ++side) fs::create_directories(image(side, 0).parent_path());
    std::ofstream times(sequence_ / "times.txt"), poses(root_ / "truth.txt");
    for (int i = 0; i < kPairs; ++i) {
      for (int side = 0; side < 2; ++side)
        cv::imwrite(image(side, i).string(),
                    synthetic::renderPlane(texture, camera, kWall - kStep * i, side * kBaseline));
      times << 0.1 * i << "\n";
      poses << "1 0 0 0 0 1 0 0 0 0 1 " << kStep * i << "\n";
    }
    writeCalibration(-300.0 * kBaseline);
  }

  fs::path image(int side, int i) const {
    return sequence_ / ("image_" + std::to_string(side)) / ("00000" + std::to_string(i) + ".png");
  }

  void writeCalibration(double tx) const {
    std::ofstream(sequence_ / "calib.txt") << "P0: 300 0 160 0 0 300 120 0 0 0 1 0\n"
                                           << "P1: 300 0 160 " << tx << " 0 300 120 0 0 0 1 0\n";
  }

  /// Runs a tool; `arguments` must hold no character that is special to a shell.
  Outcome run(const std::string& tool, const std::string& arguments, const std::string& before = "") const {
    const fs::path out = root_ / "stdout", err = root_ / "stderr";
    const std::string command = before + SDVO_TOOL_DIR + "/" + tool + " " + arguments + " > " + out.string() + " 2> " +
                                err.string() + " < /dev/null";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, readText(out), readText(err)};
  }

  /// run() of a tool that has to succeed.
  Outcome succeed(const std::string& tool, const std::string& arguments) const {
    const Outcome outcome = run(tool, arguments);
    EXPECT_EQ(outcome.exit_code, 0) << tool << " " << arguments << ": " << outcome.err;
    return outcome;
  }

  /// A file of this test.
  std::string in(const std::string& name) const { return (root_ / name).string(); }
  std::vector<std::string> linesIn(const std::string& name) const { return linesOf(readText(root_ / name)); }

  Outcome runOn(const std::string& recording, const std::string& extra = "") const {
    return run("run_sequence", recording + " --poses " + in("poses.txt") + " " + extra);
  }
  Outcome runSequence(const std::string& extra = "") const { return runOn(drive_, extra); }

  /// The poses of a recording that is followed.
  std::string posesOf(const std::string& recording, const std::string& extra = "") const {
    fs::remove(in("poses.txt"));
    succeed("run_sequence", recording + " --poses " + in("poses.txt") + " " + extra);
    return poses();
  }
  std::string poses() const { return readText(root_ / "poses.txt"); }

  void darken(int side, int pair) const {
    cv::imwrite(image(side, pair).string(), cv::Mat(240, 320, CV_8UC1, cv::Scalar(0)));
  }

  /// The drive as a bag.
  std::string bag(const std::string& name) const {
    succeed("convert", drive_ + " --output " + in(name + ".bag"));
    return in(name + ".bag");
  }
  /// A bag of what `write` makes of each message of another one.
  using Write = std::function<void(rosbag::Bag&, const rosbag::MessageInstance&)>;
  std::string rewritten(const std::string& bag, const std::string& name, const Write& write) const {
    const rosbag::Bag from(bag);
    rosbag::Bag out(in(name + ".bag"), rosbag::bagmode::Write);
    for (const rosbag::MessageInstance& message : rosbag::View(from)) write(out, message);
    return in(name + ".bag");
  }
  /// The drive as a raw folder of EuRoC's or TUM-VI's.
  fs::path rawFolder(const std::string& lens) const {
    const fs::path asl = root_ / lens;
    for (int side = 0; side < 2; ++side) {
      const fs::path camera = asl / "mav0" / ("cam" + std::to_string(side));
      fs::create_directories(camera / "data");
      std::ofstream list(camera / "data.csv");
      for (int i = 0; i < kPairs; ++i) {
        const std::string stamp = std::to_string(1400000000000000000 + i * 100000000);
        list << stamp << "," << stamp << ".png\n";
        fs::copy(image(side, i), camera / "data" / (stamp + ".png"));
      }
      std::ofstream(camera / "sensor.yaml")
          << "camera_model: pinhole\ndistortion_model: " << lens << "\nresolution: [320, 240]\n"
          << "intrinsics: [300, 300, 160, 120]\ndistortion_coefficients: [0.01, 0, 0, 0]\n"
          << "T_BS: {data: [1, 0, 0, " << side * kBaseline << ", 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}\n";
    }
    return asl;
  }

  Outcome runBags(const std::string& bags, const std::string& extra = "") const {
    return run("run_sequence", bags + " --output " + results_.string() + " " + extra);
  }

  /// Bad input ends with one line that says what is wrong, and never with a signal or an exit code of zero.
  static void expectError(const Outcome& outcome, const std::string& said) {
    SCOPED_TRACE("stdout: " + outcome.out + "\nstderr: " + outcome.err);
    EXPECT_GT(outcome.exit_code, 0);
    const std::vector<std::string> errors = errorLines(outcome);
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_TRUE(contains(errors.front(), said)) << "expected it to say: " << said;
    EXPECT_EQ(linesOf(outcome.err).back(), errors.front()) << "the error is not the last thing said";
  }

  const TemporaryFolder folder_;
  const fs::path root_ = folder_.path(), sequence_ = root_ / "sequences" / "09", results_ = root_ / "results";
  const std::string drive_ = sequence_.string();
};

TEST_F(Tools, AllExplainThemselves) {
  for (const char* tool : {SDVO_TOOLS}) {
    const Outcome outcome = succeed(tool, "--help");
    EXPECT_TRUE(contains(outcome.out, "--help")) << tool;
    EXPECT_EQ(outcome.err, "") << tool;
    expectError(run(tool, "--no-such-option"), "--help");
  }
}

/// By each tool that reads one.
TEST_F(Tools, ASoundSequenceIsReadAndADamagedOneIsNamed) {
  const fs::path sound = root_ / "sound";
  fs::copy(sequence_, sound, fs::copy_options::recursive);
  const auto readBy = [this](bool converter) {
    return converter ? run("convert", drive_ + " --output " + in("reader.bag"))
                     : run("run_sequence", drive_ + " --poses " + in("reader.txt"));
  };
  const std::vector<std::pair<std::function<void()>, std::string>> damages = {
      {[] {}, ""},
      {[this] { fs::remove(sequence_ / "calib.txt"); }, (sequence_ / "calib.txt").string()},
      {[this] { fs::remove_all(sequence_); }, drive_},
      {[this] { fs::resize_file(image(1, 2), fs::file_size(image(1, 2)) / 2); }, image(1, 2).string()},
      {[this] { cv::imwrite(image(1, 1).string(), cv::Mat(200, 320, CV_8U, cv::Scalar(90))); }, image(1, 1).string()},
      {[this] { writeCalibration(0.0); }, "baseline"}};
  for (const auto& [damage, words] : damages) {
    fs::remove_all(sequence_);
    fs::copy(sound, sequence_, fs::copy_options::recursive);
    damage();
    fs::remove(in("reader.bag"));
    for (const bool converter : {false, true}) {
      const Outcome outcome = readBy(converter);
      if (!words.empty()) {
        expectError(outcome, words);
        continue;
      }
      EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
      EXPECT_TRUE(errorLines(outcome).empty()) << outcome.err;
    }
  }
}

TEST_F(Tools, OutputThatCannotBeWritten) {
  const std::string missing = in("missing/out.bag"), truth = in("truth.txt");
  for (const auto& [tool, arguments] : std::vector<std::pair<std::string, std::string>>{
           {"run_sequence", drive_ + " --poses "},
           {"run_sequence", drive_ + " --poses /dev/null --timing "},
           {"run_sequence", drive_ + " --poses /dev/null --states "},
           {"convert", drive_ + " --output "},
           {"evaluate_trajectory", "--ground-truth " + truth + " --estimate " + truth + " --lengths 0.2 --json "}})
    for (const std::string& output : {missing, std::string("/dev/full")}) expectError(run(tool, arguments + output), output);
  EXPECT_EQ(run("list_parameters", "> /dev/full || echo failed").out, "failed\n");
}

TEST_F(Tools, OutputIsNeverADeviceOrAPipe) {
  const fs::path pipe = root_ / "pipe.bag", device = root_ / "device.bag";
  fs::create_symlink("/dev/null", device);
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& output : {pipe.string(), device.string()})
    expectError(run("convert", drive_ + " --output " + output), "no regular file");
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_FALSE(fs::exists(pipe.string() + ".active"));
}

/// Neither a file of another kind, nor its own on a full disk; a bag not at all.
TEST_F(Tools, NoOutputDestroysAFile) {
  const std::string truth = in("truth.txt");
  const fs::path output = root_ / "output";
  for (const auto& [tool, arguments] : std::vector<std::pair<std::string, std::string>>{
           {"run_sequence", drive_ + " --poses"},
           {"run_sequence", drive_ + " --format tum --poses"},
           {"run_sequence", drive_ + " --poses /dev/null --timing"},
           {"run_sequence", drive_ + " --poses /dev/null --states"},
           {"run_sequence", drive_ + " --page"},
           {"evaluate_trajectory", "--ground-truth " + truth + " --estimate " + truth + " --lengths 0.2 --json"},
           {"convert", drive_ + " --output"}}) {
    SCOPED_TRACE(tool + " " + arguments);
    const std::string command = arguments + " " + output.string();
    std::ofstream(output) << "precious, 7 days of work";
    expectError(run(tool, command), output.string());
    EXPECT_EQ(readText(output), "precious, 7 days of work");
    fs::remove(output);
    if (tool[0] == 'c') continue;  // makes a folder
    ASSERT_EQ(run(tool, command).exit_code, 0);
    const bool is_bag = tool[0] == 'k';
    EXPECT_EQ(run(tool, command).exit_code, is_bag ? 1 : 0);
    const std::string before = readText(output);
    if (is_bag) fs::remove(output);
    // The table of evaluate_trajectory would not fit either.
    if (tool[0] != 'e') expectError(run(tool, command, "trap '' XFSZ; ulimit -f 1; "), output.string());
    EXPECT_TRUE(is_bag || readText(output) == before);
    for (const auto& entry : fs::directory_iterator(root_))
      EXPECT_FALSE(contains(entry.path().string(), "partial")) << entry.path();
    fs::remove(output);
  }
}

/// They would be taken for its own poses.
TEST_F(Tools, TruePosesAreNoOutput) {
  const fs::path beside = sequence_ / "poses.txt", truth = root_ / "truth.txt";
  fs::copy_file(truth, beside);
  const std::string words = "has true poses, or is another output";
  expectError(run("run_sequence", drive_ + " --poses " + beside.string()), words);
  expectError(run("run_sequence", drive_ + " --page " + in("page.html") + " --ground-truth " + truth.string() +
                                      " --poses " + truth.string()),
              words);
  const fs::path named = root_ / (sequence_.filename().string() + ".txt");  // what --output writes there
  fs::copy_file(truth, named);
  expectError(run("run_sequence", drive_ + " --page " + in("page.html") + " --ground-truth " + named.string() +
                                      " --format kitti --output " + root_.string()),
              words);
  for (const fs::path& path : {beside, named}) EXPECT_EQ(readText(path), readText(truth));
}

TEST_F(Tools, OptionsThatDoNotExistOrAreOutOfRange) {
  const std::vector<std::pair<std::string, std::string>> options = {
      {"--param detector/no_such_option=1", "detector/no_such_option"},
      {"--param map/keyframes=1", "map/keyframes"},
      {"--param map/keyframes=many", "map/keyframes"},
      {"--param motion/consensus=square", "motion/consensus"},
      {"--param map/keyframes", "name=value"},
      // Each in its range, but nothing would be aligned.
      {"--param descriptor/patch_side=9", "descriptor/patch_side"},
      {"--frames 0", "--frames"},
      {"--config " + in("none.yaml"), in("none.yaml")}};
  for (const auto& [option, words] : options) expectError(runSequence(option), words);
  const std::vector<std::pair<std::string, std::string>> configs = {
      {"visual_odometry: {motion: {no_such_option: 1}}\n", "no_such_option"},
      {"visual_odometry: {map: {keyframes: 1}}\n", "map/keyframes"},
      {"visual_odometry: [unfinished\n", in("config.yaml")}};
  for (const auto& [text, words] : configs) {
    std::ofstream(in("config.yaml")) << text;
    expectError(runSequence("--config " + in("config.yaml")), words);
  }
}

TEST_F(Tools, OnePoseForEachPairAndTheDriveIsFollowed) {
  const Outcome outcome = runSequence("--timing " + in("timing.csv"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(contains(outcome.out, "options ")) << "no hash of the options: " << outcome.out;

  const std::vector<std::string> lines = linesIn("poses.txt"), rows = linesIn("timing.csv");
  ASSERT_EQ(lines.size(), static_cast<std::size_t>(kPairs));
  ASSERT_EQ(rows.size(), static_cast<std::size_t>(kPairs) + 1);
  EXPECT_EQ(rows.front().rfind("frame,total_ms,detect_ms,stereo_ms,describe_ms,match_ms,motion_ms,", 0), 0u);
  const auto commas = [](const std::string& row) { return std::count(row.begin(), row.end(), ','); };
  for (std::size_t i = 0; i < kPairs; ++i) {
    const std::vector<double> numbers = numbersOf(lines[i]);
    ASSERT_EQ(numbers.size(), 12u);
    EXPECT_NEAR(numbers[3], 0.0, 0.05) << "pair " << i;
    EXPECT_NEAR(numbers[7], 0.0, 0.05) << "pair " << i;
    EXPECT_NEAR(numbers[11], kStep * static_cast<double>(i), 0.05) << "pair " << i;
    EXPECT_EQ(rows[i + 1].rfind(std::to_string(i) + ",", 0), 0u) << rows[i + 1];
    EXPECT_EQ(commas(rows[i + 1]), commas(rows.front())) << rows[i + 1];
  }
}

TEST_F(Tools, PlacesByASwitch) {
  const auto arguments = [this](const std::string& name) {
    return drive_ + " --poses " + in(name + ".txt") + " --odometry " + in(name + "_odometry.txt") + " --keyframes " +
           in(name + ".csv") + " --ground-truth " + in("truth.txt") + " --before " + drive_ +
           " --param place_recognition/keyframe_distance=0.15";  // m, below a step
  };
  const Outcome named = run("run_sequence", "--places " + arguments("named"));
  if (named.err.find("without Ceres") != std::string::npos) GTEST_SKIP() << named.err;
  ASSERT_EQ(named.exit_code, 0) << named.err;
  EXPECT_TRUE(contains(named.out, "\nrevisits ")) << named.out;
  EXPECT_EQ(linesIn("named.txt").size(), static_cast<std::size_t>(kPairs));
  EXPECT_EQ(linesIn("named.csv").size(), 2u * kPairs + 1u);
  EXPECT_EQ(posesOf(drive_), readText(in("named_odometry.txt")));
  expectError(run("run_sequence", arguments("neither")), "need --places");
  ASSERT_EQ(run("run_sequence", "--places --format tum " + arguments("stamped")).exit_code, 0);
  for (const std::string name : {"stamped.txt", "stamped_odometry.txt"})
    EXPECT_EQ(numbersOf(linesIn(name).at(1)).size(), 8u) << name;
}

TEST_F(Tools, TimingEndsWithTheReasonWithoutCommas) {
  // A grey right image refuses the pair, and the odometry says why.
  cv::imwrite(image(1, 2).string(), cv::Mat1b(240, 320, std::uint8_t{90}));
  posesOf(drive_, "--timing " + in("timing.csv") + " --states " + in("states.csv"));
  const std::vector<std::string> rows = linesIn("timing.csv"), stated = linesIn("states.csv");
  const auto last = [](const std::string& row) { return row.substr(row.rfind(',') + 1); };
  EXPECT_EQ(last(rows.front()), "reason");
  EXPECT_EQ(last(rows[2]), "") << rows[2];
  std::string reason = stated[3];
  for (int field = 0; field < 78; ++field) reason.erase(0, reason.find(',') + 1);
  std::replace(reason.begin(), reason.end(), ',', ';');
  EXPECT_FALSE(reason.empty()) << stated[3];
  EXPECT_EQ(last(rows[3]), reason) << rows[3];
}

TEST_F(Tools, StatesHaveTheCovariancesOfEachPair) {
  posesOf(drive_, "--states " + in("states.csv"));
  const std::vector<std::string> rows = linesIn("states.csv");
  ASSERT_EQ(rows.size(), static_cast<std::size_t>(kPairs) + 1);
  EXPECT_EQ(rows.front().rfind("frame,stamp_ns,state,epoch,has_pose,has_motion,motion_00,", 0), 0u);
  for (int i = 0; i < kPairs; ++i) {
    const std::vector<std::string> fields = cellsOf(rows[static_cast<std::size_t>(i) + 1]);
    ASSERT_GE(fields.size(), 78u);
    EXPECT_EQ(fields[0], std::to_string(i));
    EXPECT_EQ(fields[1], std::to_string(i * 100000000));
    EXPECT_EQ(fields[2], "TRACKING");
    EXPECT_EQ(fields[5], i == 0 ? "0" : "1");
    if (i == 0) continue;
    for (const int diagonal : {6, 13, 20, 27, 34, 41}) {
      EXPECT_GT(std::stod(fields[diagonal]), 0.0) << "motion, pair " << i;
      EXPECT_GT(std::stod(fields[diagonal + 36]), 0.0) << "pose, pair " << i;
    }
  }
}

TEST_F(Tools, FramesLimitsThePairs) {
  EXPECT_EQ(linesOf(posesOf(drive_, "--frames 2")).size(), 2u);
}

TEST_F(Tools, ResultsAreBitIdenticalInEveryRunAndWithAnyThreads) {
  const std::string first = posesOf(drive_, "--threads 1");
  for (const char* threads : {"--threads 1", "--threads 2", "--threads 3"})
    EXPECT_EQ(posesOf(drive_, threads), first) << threads;
}

TEST_F(Tools, BagsGiveWhatTheirSequencesGive) {
  const std::string expected = posesOf(drive_), a = bag("a");
  for (const fs::path& recording : {sequence_, fs::path(a)}) {
    const std::string name = recording.stem().string();
    EXPECT_EQ(runBags(recording.string(), "--format kitti").exit_code, 0);
    const std::vector<std::string> report = linesIn("results/report.csv");
    ASSERT_EQ(report.size(), 2u);
    EXPECT_EQ(report[1].rfind(name + ",4,0,0,0,", 0), 0u) << report[1];
    EXPECT_EQ(readText(results_ / (name + ".txt")), expected);
    EXPECT_EQ(linesIn("results/" + name + ".csv").size(), static_cast<std::size_t>(kPairs) + 1);
  }
  EXPECT_EQ(posesOf(a, "--threads 2"), expected);

  // TUM's format has the stamps: times.txt plus 1e9 s.
  fs::remove(results_ / "a.txt");
  ASSERT_EQ(runBags(a).exit_code, 0);
  const std::vector<std::string> lines = linesIn("results/a.txt");
  ASSERT_EQ(lines.size(), static_cast<std::size_t>(kPairs) + 1);  // and a comment
  EXPECT_EQ(lines[1].rfind("1000000000.000000000 ", 0), 0u) << lines[1];
  EXPECT_EQ(lines[4].rfind("1000000000.300000000 ", 0), 0u) << lines[4];
}

/// As a RealSense D400 names its topics, with images as image_transport compresses them.
TEST_F(Tools, BagsOfOtherNamesAndCompressedImages) {
  sensor_msgs::CameraInfo infos[2];
  const auto topicOf = [](int side) { return "/camera/infra" + std::to_string(1 + side); };
  const auto writeInfo = [&](rosbag::Bag& out, int side, ros::Time time) {
    out.write(topicOf(side) + "/camera_info", time, infos[side]);
  };
  const std::string renamed = rewritten(bag("plain"), "renamed", [&](rosbag::Bag& out, const auto& message) {
    const int side = contains(message.getTopic(), "/left/") ? 0 : 1;
    if (const auto info = message.template instantiate<sensor_msgs::CameraInfo>()) {
      infos[side] = *info;
      writeInfo(out, side, message.getTime());
    }
    const auto image = message.template instantiate<sensor_msgs::Image>();
    if (!image) return;
    sensor_msgs::CompressedImage compressed;
    compressed.header = image->header;
    compressed.format = "mono8; png compressed mono8";
    cv::imencode(".png", cv::Mat(240, 320, CV_8U, const_cast<std::uint8_t*>(image->data.data())), compressed.data);
    out.write(topicOf(side) + "/image_rect_raw/compressed", message.getTime(), compressed);
  });
  {
    rosbag::Bag out(renamed, rosbag::bagmode::Append);
    sensor_msgs::CompressedImage torn;  // whose pair is left out
    torn.header.stamp = ros::Time(1000000001.0);
    for (const int side : {0, 1}) {
      out.write(topicOf(side) + "/image_rect_raw/compressed", torn.header.stamp, torn);
      infos[side].header.stamp = torn.header.stamp;
      writeInfo(out, side, torn.header.stamp);
    }
  }
  const std::string names = " --camera /camera --left infra1 --right infra2 --image image_rect_raw";
  const std::string expected = posesOf(drive_);
  const Outcome outcome = runBags(renamed, "--format kitti --shuttle" + names);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(linesIn("results/report.csv").at(1).rfind("renamed,4,0,0,1,", 0), 0u);
  EXPECT_TRUE(contains(outcome.out, "shuttle: error about ")) << outcome.out;
  EXPECT_EQ(readText(results_ / "renamed.txt"), expected);
  for (const std::string only : {"", " --camera /camera"}) {  // the bag's only stereo camera, or that of a namespace
    fs::remove(results_ / "renamed.txt");
    EXPECT_EQ(runBags(renamed, "--format kitti" + only).exit_code, 0);
    EXPECT_EQ(readText(results_ / "renamed.txt"), expected);
  }
  expectError(runBags(renamed, "--camera /other"),
              "has no /other/left/image_rect; its images: /camera/infra1/image_rect_raw");

  const std::string checked = run("check_camera", "--bag " + renamed + names).out;
  EXPECT_EQ(checked.rfind("OK   topics", 0), 0u) << checked;
  EXPECT_TRUE(contains(checked, "cannot be decoded")) << checked;
}

/// As `rosbag record --split` leaves a drive: the end of a part may divide a pair.
TEST_F(Tools, PartsOfADriveAreJoined) {
  const std::string expected = posesOf(drive_), whole = bag("whole");
  std::string parts[2];
  for (const bool is_second : {false, true})
    parts[is_second] = rewritten(whole, is_second ? "drive_1" : "drive_0", [&](rosbag::Bag& out, const auto& message) {
      const ros::Time third(1000000000, 200000000), time = message.getTime();
      if ((time > third || (time == third && contains(message.getTopic(), "/right/image"))) == is_second)
        out.write(message.getTopic(), message.getTime(), message);
    });
  EXPECT_EQ(posesOf(parts[0] + " " + parts[1], "--join --shuttle"), expected);
  expectError(runOn(parts[0] + " " + parts[1]), "--join");
  expectError(runOn(parts[1] + " " + parts[0], "--join"), "drive_0.bag' is not later than");
}

TEST_F(Tools, RecordingsThatCannotBeReadAreNamedWithTheRemedy) {
  const std::string killed = bag("killed"), torn = bag("torn"), pipe = in("pipe.bag");
  {
    std::fstream file(killed, std::ios::in | std::ios::out | std::ios::binary);
    std::string head(4096, '\0');
    file.read(head.data(), 4096);
    file.seekp(static_cast<std::streamoff>(head.find("index_pos=") + 10));
    file.write("\0\0\0\0\0\0\0\0", 8);
  }
  fs::resize_file(torn, fs::file_size(torn) / 2);
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const bool checker : {false, true}) {
    const auto read = [&](const std::string& bag) {
      return checker ? run("check_camera", "--bag " + bag) : runOn(bag);
    };
    expectError(read(killed),
                "killed.bag' has no index, as of a recorder that was killed: where none runs any more, rosbag reindex");
    expectError(read(torn), "torn.bag'");
    expectError(read(pipe), "pipe.bag' is no file");
    const std::ofstream recorder(killed, std::ios::app);
    expectError(read(killed), "killed.bag' is being written: end its recorder");
  }
  expectError(runOn("nosuch.bag"), "there is no 'nosuch.bag'");
  expectError(runSequence("--config " + pipe), "pipe.bag: it is no file");
}

/// The drive as a raw folder of EuRoC's is rectified on the fly, or by convert.
TEST_F(Tools, RawFoldersOfEuroc) {
  const std::string asl = rawFolder("radial-tangential").string(), rectified = in("rectified");
  const std::vector<std::string> lines = linesOf(posesOf(asl, "--format tum"));
  succeed("convert", asl + "/mav0 --output " + rectified);
  const std::vector<std::string> expected = linesOf(posesOf(rectified));
  ASSERT_EQ(lines.size(), static_cast<std::size_t>(kPairs) + 1);  // and a comment
  for (std::size_t i = 0; i < kPairs; ++i) {
    const std::vector<double> pose = numbersOf(lines[i + 1]), same = numbersOf(expected[i]);
    for (const std::size_t axis : {0u, 1u, 2u}) EXPECT_NEAR(pose.at(1 + axis), same.at(3 + 4 * axis), 1e-6);
    EXPECT_NEAR(pose[0], 1.4e9 + 0.1 * static_cast<double>(i), 1e-6);
    EXPECT_NEAR(pose[3], kStep * static_cast<double>(i), 0.05);
  }

  succeed("convert", asl + " --frames 3 --output " + in("raw.bag"));
  rosbag::Bag raw(in("raw.bag"));
  EXPECT_EQ(rosbag::View(raw, rosbag::TopicQuery("/stereo/right/image_raw")).size(), 3u);
}

/// With its camera_info a raw bag gives what its folder gives; without it a calibration is asked for.
TEST_F(Tools, RawBagsAreRectified) {
  for (const std::string lens : {"radial-tangential", "equidistant"})
    for (const std::string fov : {"", " --fov 70"}) {
      const fs::path asl = rawFolder(lens);
      const std::string raw = in("raw.bag"), folder = in(lens + std::to_string(fov.size()));
      const std::string expected = posesOf(asl.string(), fov);
      succeed("convert", asl.string() + " --output " + raw);
      EXPECT_EQ(posesOf(raw, fov + " --page " + in("page.html")), expected) << lens << fov;
      EXPECT_TRUE(contains(readPage(in("page.html")), "raw images rectified here"));
      const std::string bare = rewritten(raw, "bare", [](rosbag::Bag& out, const auto& message) {
        if (contains(message.getTopic(), "image_raw"))
          out.write(contains(message.getTopic(), "left") ? "/cam0/image_raw" : "/cam1/image_raw", message.getTime(),
                    message);
      });
      const std::string sensors = " --calibration " + (asl / "mav0" / "cam0" / "sensor.yaml").string() + " " +
                                  (asl / "mav0" / "cam1" / "sensor.yaml").string();
      for (const auto& [tool, arguments] :
           std::vector<std::pair<std::string, std::string>>{{"run_sequence", bare + " --poses " + in("poses.txt")},
                                                            {"check_camera", "--bag " + bare},
                                                            {"convert", bare + " --output " + folder}}) {
        expectError(run(tool, arguments), "no /cam0/camera_info");
        const Outcome given = run(tool, arguments + sensors + fov);
        EXPECT_NE(given.exit_code, 1) << given.err;
      }
      EXPECT_EQ(poses(), expected) << lens << fov;
      for (const fs::path& made : {asl, fs::path(raw), fs::path(bare)}) fs::remove_all(made);
    }
}

/// As converters from ROS 2 leave it: fields with other names, so another MD5.
TEST_F(Tools, MessagesAreKnownByWhatTheyHold) {
  const std::string plain = bag("plain");
  const auto changed = [&](const std::string& name, const std::string& definition) {
    return rewritten(plain, name, [&](rosbag::Bag& out, const auto& message) {
      const auto header = boost::make_shared<ros::M_string>(*message.getConnectionHeader());
      if (message.getDataType() == "sensor_msgs/CameraInfo") {
        (*header)["md5sum"] = "b5aff04250fbf270b71bef9d82c2132e";
        (*header)["message_definition"] = definition;
      }
      out.write(message.getTopic(), message.getTime(), message, header);
    });
  };
  std::string ros2 = ros::message_traits::definition<sensor_msgs::CameraInfo>();
  for (const auto& [from, to] : {std::pair("float64[] D", "float64[] d"), std::pair("float64[9]  K", "float64[9] k")})
    ros2.replace(ros2.find(from), std::string(from).size(), to);
  EXPECT_EQ(posesOf(changed("ros2", ros2)), posesOf(drive_));
  expectError(runOn(changed("other", "uint32 height\n" + ros2)), "of another definition: uint32 (uint32 time");
  std::ofstream(in("drive.db3")) << "SQLite format 3";
  expectError(runOn(in("drive.db3")), "a bag of ROS 2");
}

TEST_F(Tools, ABagBecomesAFolder) {
  const fs::path folder = root_ / "folder";
  succeed("convert", bag("a") + " --poses " + in("truth.txt") + " --output " + folder.string());
  EXPECT_EQ(posesOf(folder.string()), posesOf(drive_));
  EXPECT_EQ(linesIn("folder/poses.txt").size(), static_cast<std::size_t>(kPairs));
}

/// Lines of a truth without stamps are of all left images, also of those that make no pair.
TEST_F(Tools, TheTruthOfABagThatLacksAnImageIsThatOfItsPairs) {
  const std::string torn = rewritten(bag("whole"), "torn", [n = 0](rosbag::Bag& out, const auto& message) mutable {
    if (!contains(message.getTopic(), "/right/image") || n++ != 1) out.write(message.getTopic(), message.getTime(), message);
  });
  succeed("convert", torn + " --poses " + in("truth.txt") + " --output " + in("folder"));
  const std::vector<std::string> poses = linesIn("folder/poses.txt");
  ASSERT_EQ(poses.size(), static_cast<std::size_t>(kPairs - 1));
  EXPECT_NEAR(numbersOf(poses[1])[11], 2 * kStep, 1e-9);
  const Outcome outcome = runOn(torn);
  EXPECT_EQ(outcome.exit_code, 0);
  expectWords(outcome.err, {"--format tum"});
}

TEST_F(Tools, ABaselineOnTfStandsForOneThatCameraInfoLacks) {
  const std::string simulated = rewritten(bag("told"), "simulated", [](rosbag::Bag& out, const auto& message) {
    const auto info = message.template instantiate<sensor_msgs::CameraInfo>();
    if (!info) return out.write(message.getTopic(), message.getTime(), message);
    info->P[3] = 0.0;
    if (contains(message.getTopic(), "/right/")) info->header.frame_id = "stereo_right_optical";
    out.write(message.getTopic(), message.getTime(), *info);
  });
  EXPECT_EQ(posesOf(simulated), posesOf(drive_));
}

TEST_F(Tools, AMosaicIsNamed) {
  for (int i = 0; i < kPairs; ++i) {
    cv::Mat left = cv::imread(image(0, i).string(), cv::IMREAD_GRAYSCALE);
    for (int y = 0; y < left.rows; ++y)
      for (int x = y % 2; x < left.cols; x += 2) left.at<std::uint8_t>(y, x) /= 2;
    cv::imwrite(image(0, i).string(), left);
  }
  const Outcome outcome = runSequence("--states " + in("states.csv"));
  expectWords(outcome.err, {"left image", "mosaic", "stereo_raw.launch"});
}

/// Many recordings, a process for each: what is finished stays.
TEST_F(Tools, ManyRecordings) {
  const fs::path good = bag("good"), bad = root_ / "bad.bag";
  std::ofstream(bad) << "no bag";
  const auto runMany = [&](const std::string& arguments) {
    return run("run_many", root_.string() + " --jobs 2 --output " + results_.string() + arguments);
  };
  Outcome outcome = runMany(" -- --format kitti");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_EQ(outcome.out.rfind("bad,,,,,,,,,,", 0), 0u) << outcome.out;
  EXPECT_TRUE(contains(outcome.out, "1 of 2 recordings are finished")) << outcome.out;
  const fs::path result = results_ / "good" / "good.txt";
  EXPECT_EQ(linesIn("results/good/good.txt").size(), static_cast<std::size_t>(kPairs));
  const fs::file_time_type finished = fs::last_write_time(result);
  EXPECT_EQ(runMany("").exit_code, 1);  // other arguments
  expectError(run("run_sequence", root_.string() + " --output " + results_.string()), "run_many");
  expectError(run("run_sequence", good.string() + " " + bad.string() + " --output " + results_.string()), "run_many");
  expectError(runBags(good.string(), "--param motion/consensus=square"), "motion/consensus");
  expectError(run("run_sequence", good.string()), "--output");

  fs::remove(bad);
  fs::copy(good, bad);
  outcome = runMany(" -- --format kitti");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  EXPECT_EQ(fs::last_write_time(result), finished);
  EXPECT_EQ(linesIn("results/report.csv").size(), 3u);
}

TEST_F(Tools, RecordingsCheckThemselves) {
  const fs::path checks = results_ / "a.self_check.csv", a = bag("a");
  ASSERT_EQ(runBags(a.string()).exit_code, 0);
  EXPECT_FALSE(fs::exists(checks));
  const std::string poses_alone = readText(results_ / "a.txt");

  const Outcome outcome = runBags(a.string(), "--shuttle --halves");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(readText(results_ / "a.txt"), poses_alone);
  const std::vector<std::string> lines = linesIn("results/a.self_check.csv");
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0].rfind("check,pairs,distance_m,end_m,", 0), 0u);
  for (const std::size_t i : {1u, 2u}) {
    const std::vector<std::string> fields = cellsOf(lines[i]);
    ASSERT_GE(fields.size(), 11u) << lines[i];
    EXPECT_EQ(fields[0], i == 1 ? "shuttle" : "halves");
    EXPECT_EQ(fields[1], std::to_string(kPairs));
    EXPECT_NEAR(std::stod(fields[2]), (kPairs - 1) * kStep, 0.02);
    EXPECT_GT(std::stod(fields[3]), 0.0);
    EXPECT_LT(std::stod(fields[3]), 0.03);
    EXPECT_TRUE(contains(outcome.out, "\n" + fields[0] + ": error about ")) << outcome.out;
  }
  // The images of a folder are those of its bag.
  const std::string said = runSequence("--shuttle --halves").out;
  for (const std::string& line : linesOf(outcome.out))
    if (line.find(": error about ") != std::string::npos) {
      EXPECT_TRUE(contains(said, "\n" + line + "\n")) << said;
    }

  ASSERT_EQ(runBags(a.string()).exit_code, 0);
  EXPECT_FALSE(fs::exists(checks)) << "of another run than the poses beside it";
}

/// The way back finds the messages of a pair by when they were recorded, which need not be one after the other.
TEST_F(Tools, AShuttleFindsPairsHoweverTheyWereRecorded) {
  const std::string plain = bag("plain");
  for (const bool is_at_once : {true, false})
    rewritten(plain, is_at_once ? "at_once" : "late", [&](rosbag::Bag& out, const auto& message) {
      if (message.getTopic().rfind("/stereo/", 0) != 0) return;
      const bool is_late = !is_at_once && message.getTopic() == "/stereo/right/image_rect";
      const ros::Time time = message.getTime() + ros::Duration(is_late ? 0.25 : 0.0);
      out.write(message.getTopic(), is_at_once ? ros::Time(1000000009.0) : time, message,
                message.getConnectionHeader());
    });
  std::string expected;
  for (const std::string name : {"plain", "at_once", "late"}) {
    const Outcome outcome = runBags(in(name + ".bag"), "--shuttle");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::string checks = readText(results_ / (name + ".self_check.csv"));
    EXPECT_TRUE(contains(checks, "shuttle,4,"));
    if (name == "plain") expected = checks;
    EXPECT_EQ(checks, expected);
  }
}

TEST_F(Tools, ALostDriveDoesNotPassItsSelfChecks) {
  for (int i = 1; i < kPairs; ++i)
    for (const int side : {0, 1}) darken(side, i);
  const Outcome outcome = runBags(drive_, "--shuttle --halves");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const std::string check : {"shuttle", "halves"}) {
    EXPECT_TRUE(contains(outcome.out, check + ": no figure")) << outcome.out;
    EXPECT_TRUE(contains(readText(results_ / "09.self_check.csv"), "\n" + check + ",4,"));
  }
  EXPECT_TRUE(contains(outcome.out, "pairs have no pose")) << outcome.out;
}

/// Of all stamps that wait, images are held in memory, so only so many may.
TEST_F(Tools, MessagesThatMakeNoPairDoNotKeepOthersFromIt) {
  constexpr int kAlone = 250;
  int alone = 0;
  const std::string mixed = rewritten(bag("good"), "mixed", [&](rosbag::Bag& out, const auto& message) {
    for (sensor_msgs::CameraInfo info; alone < kAlone; ++alone) {
      info.header.stamp = ros::Time(999999000 + alone, 0);
      out.write("/stereo/left/camera_info", info.header.stamp, info);
    }
    out.write(message.getTopic(), message.getTime(), message, message.getConnectionHeader());
  });
  ASSERT_EQ(runBags(mixed).exit_code, 0);
  const std::string row = linesIn("results/report.csv").at(1);
  EXPECT_EQ(row.rfind("mixed,4,0,0," + std::to_string(kAlone) + ",", 0), 0u) << row;
}

TEST_F(Tools, ABagWithoutTimesSaysSo) {
  {
    rosbag::Bag out(in("zero.bag"), rosbag::bagmode::Write);
    for (const std::string side : {"left", "right"}) {
      out.write("/stereo/" + side + "/image_rect", ros::Time(1.0), sensor_msgs::Image());
      out.write("/stereo/" + side + "/camera_info", ros::Time(1.0), sensor_msgs::CameraInfo());
    }
  }
  expectError(runOn(in("zero.bag")), "no pair can be used: /stereo/");
  expectError(runBags(in("zero.bag")), "zero stamp");
  EXPECT_FALSE(fs::exists(results_ / "report.csv"));
}

TEST_F(Tools, HashTellsOptionsApart) {
  const auto hash = [this](const std::string& extra) { return linesOf(runSequence("--frames 1 " + extra).out).at(0); };
  const auto hashOf = [&](const std::string& config) {
    std::ofstream(in("config.yaml")) << config;
    return hash("--config " + in("config.yaml"));
  };
  const std::string defaults = hash("");
  EXPECT_EQ(hash(""), defaults);
  EXPECT_NE(hash("--param map/keyframes=9"), defaults);
  // What is the nodelets' alone has no effect on the tools.
  EXPECT_EQ(hash("--param map/keyframes=9"), hashOf("stereo_features: {image_transport: compressed}\n"
                                                    "features_image: {image_transport: compressed}\n"
                                                    "visual_odometry: {map: {keyframes: 9}}\n"));
  // A block or a value that is left empty, as where all its lines are comments, is none.
  EXPECT_EQ(hashOf("stereo_features:\n  # image_transport: compressed\nvisual_odometry:\n  map:\n    keyframes:\n"),
            defaults);
  // Booleans as the launch files' rosparam reads them.
  EXPECT_EQ(hashOf("stereo_features: {descriptor: {oriented: False}}\n"), hash("--param descriptor/oriented=false"));
  EXPECT_EQ(hashOf("stereo_features: {descriptor: {oriented: Yes}}\n"), hash("--param descriptor/oriented=true"));
}

TEST_F(Tools, AnyRecordingBecomesAPage) {
  const fs::path page = root_ / "page.html";
  const std::string to_page = " --page " + page.string();
  const std::vector<std::string> all = {"Followed: 4 of 4 pairs have a pose",
                                        "implied error",
                                        "shuttle: ",
                                        "halves: ",
                                        "calibration",
                                        "stereo_descriptor_vo "};
  const Outcome outcome = succeed("run_sequence", bag("a") + to_page);
  EXPECT_TRUE(contains(outcome.out, ": Followed: 4 of 4 pairs")) << outcome.out;
  std::string json = readPage(page);
  expectWords(json, all);
  expectWords(json, {"a.bag", "looks along 1.00", "\"options\":[]"});
  const YAML::Node pairs = YAML::Load(json)["pairs"];
  for (const char* column : {"ns", "state", "reason", "pose", "sigma_m", "sigma_deg", "corners", "features", "matches",
                             "inliers", "detect", "stereo", "describe", "match", "motion"})
    EXPECT_EQ(pairs[column].size(), static_cast<std::size_t>(kPairs)) << column;
  EXPECT_EQ(pairs["ns"][1].as<std::int64_t>(), 100000000);
  EXPECT_NEAR(pairs["pose"][kPairs - 1][2].as<double>(), (kPairs - 1) * kStep, 0.1 * kStep);
  EXPECT_FALSE(pairs["truth"]);

  const std::string truth = " --ground-truth " + in("truth.txt");
  EXPECT_EQ(linesOf(posesOf(drive_, to_page + truth + " --param map/keyframes=9")).size(),
            static_cast<std::size_t>(kPairs));
  json = readPage(page);
  expectWords(json, all);
  expectWords(json, {"true error", "visual_odometry/map/keyframes", "default 8"});
  EXPECT_EQ(YAML::Load(json)["pairs"]["truth"].size(), static_cast<std::size_t>(kPairs));

  std::ofstream(root_ / "short.txt") << "1 0 0 0 0 1 0 0 0 0 1 0\n";
  expectError(runSequence(truth), "--page");
  expectError(run("run_sequence", drive_), "--page");
  expectError(run("run_sequence", drive_ + to_page + " --ground-truth " + in("short.txt")), "short.txt");
  expectError(run("run_sequence", drive_ + " --page " + in("missing/page.html")), "page.html");
}

/// Stamps of the truth are its own, and it may know only a part of the drive.
TEST_F(Tools, AGroundTruthWithStampsIsInterpolated) {
  std::ofstream(in("truth.tum")) << "# stamp x y z qx qy qz qw\n"
                                 << "1000000000.05 0 0 " << 0.5 * kStep << " 0 0 0 1\n1000000000.25 0 0 " << 2.5 * kStep
                                 << " 0 0 0 1\n";
  const std::string arguments = bag("a") + " --page " + in("page.html") + " --ground-truth " + in("truth.tum");
  succeed("run_sequence", arguments);
  expectWords(readPage(in("page.html")), {"true error", "at the end off by 0.0"});
  std::ofstream(in("truth.tum")) << "10.0 0 0 0 0 0 0 1\n11.0 0 0 0 0 0 0 1\n";
  expectError(run("run_sequence", arguments), "no poses at the stamps");
}

/// Of a body that looks along x, on which the cameras are mounted as on a drone.
TEST_F(Tools, TheTruthOfEurocIsThatOfItsBody) {
  const fs::path asl = rawFolder("radial-tangential"), page = root_ / "page.html", truth = root_ / "data.csv";
  for (int side = 0; side < 2; ++side) {
    const fs::path sensor = asl / "mav0" / ("cam" + std::to_string(side)) / "sensor.yaml";
    const std::string text = readText(sensor);
    std::ofstream(sensor) << text.substr(0, text.find("T_BS")) << "T_BS: {data: [0, 0, 1, 0.1, -1, 0, 0, "
                          << -side * kBaseline << ", 0, -1, 0, 0.2, 0, 0, 0, 1]}\n";
  }
  std::ofstream poses(truth);
  for (int i = 1; i < kPairs; ++i)  // unknown at first
    poses << 1400000000000000000 + i * 100000000 << "," << kStep * i << ",0,0,1,0,0,0,0,0,0\n";
  poses.close();
  succeed("run_sequence", asl.string() + " --page " + page.string() + " --ground-truth " + truth.string());
  const YAML::Node true_poses = YAML::Load(readPage(page))["pairs"]["truth"];
  EXPECT_TRUE(true_poses[0].IsNull());
  expectWords(readPage(page), {"at the end off by 0.0"});
}

TEST_F(Tools, ThePageOfALostDriveSaysWhere) {
  for (const int side : {0, 1}) darken(side, kPairs - 1);
  darken(1, kPairs - 2);
  EXPECT_EQ(run("run_sequence", drive_ + " --page " + in("page.html")).exit_code, 2);
  expectWords(readPage(in("page.html")), {"Interrupted: ", " of 4 pairs have no pose", "LOST", "no figure"});
  for (int pair = 0; pair < kPairs; ++pair)
    for (const int side : {0, 1}) darken(side, pair);
  run("run_sequence", drive_ + " --page " + in("page.html"));
  const std::string json = readPage(in("page.html"));
  expectWords(json, {"Never started: none of 4 pairs has a pose"});
  EXPECT_FALSE(contains(json, "Interrupted"));
  for (const YAML::Node& pose : YAML::Load(json)["pairs"]["pose"]) EXPECT_TRUE(pose.IsNull());
}

/// vo_info that was recorded while the odometry ran, in the same bag or in one of its own.
TEST_F(Tools, ThePageShowsWhatWasReportedLive) {
  const fs::path live = root_ / "live.bag", page = root_ / "page.html";
  {
    rosbag::Bag out(live.string(), rosbag::bagmode::Write);
    for (int i = 0; i < 3; ++i) {
      stereo_descriptor_vo::VoInfo info;
      info.state_id = i == 2 ? stereo_descriptor_vo::VoInfo::LOST : stereo_descriptor_vo::VoInfo::TRACKING;
      info.latency = 0.02f;
      info.dropped_pairs = 7;
      out.write("/stereo/vo_info", ros::Time(1000000000 + i, 0), info);
    }
  }
  const std::string arguments = bag("a") + " --page " + page.string() + " --live " + live.string();
  succeed("run_sequence", arguments);
  expectWords(readPage(page), {"while it ran", "2 TRACKING, 1 LOST; 7 pairs dropped"});

  // Of another version.
  fs::remove(live);
  {
    rosbag::Bag out(live.string(), rosbag::bagmode::Write);
    const auto header = boost::make_shared<ros::M_string>();
    (*header)["type"] = "stereo_descriptor_vo/VoInfo";
    (*header)["md5sum"] = "0123456789abcdef0123456789abcdef";
    (*header)["message_definition"] = "std_msgs/Header header\nstring state\n";
    out.write("/stereo/vo_info", ros::Time(1000000000, 0), stereo_descriptor_vo::VoInfo(), header);
  }
  EXPECT_TRUE(contains(succeed("run_sequence", arguments).err,
                       "/stereo/vo_info holds stereo_descriptor_vo/VoInfo of another definition"));
}

/// Of two robots in a bag the camera is on one.
TEST_F(Tools, TheBaseIsThatOfTheOdometryAboveTheCamera) {
  const std::string drive = bag("a");
  const auto check = [&](const std::vector<std::string>& bases, const std::string& arguments, const std::string& said) {
    std::vector<std::string> unnamed = bases;
    const std::string named = rewritten(drive, "named", [&](rosbag::Bag& out, const auto& message) {
      for (; !unnamed.empty(); unnamed.pop_back()) {
        nav_msgs::Odometry odometry;
        odometry.child_frame_id = unnamed.back();
        out.write("/" + unnamed.back() + "/odom", message.getTime(), odometry);
      }
      const auto transforms = message.template instantiate<tf2_msgs::TFMessage>();
      if (message.getTopic() == "/tf_static") transforms->transforms.front().header.frame_id = "/r2/base";
      transforms ? out.write(message.getTopic(), message.getTime(), *transforms)
                 : out.write(message.getTopic(), message.getTime(), message);
    });
    const Outcome outcome = run("check_camera", "--bag " + named + arguments);
    EXPECT_TRUE(contains(outcome.out, said)) << outcome.out;
  };
  check({"r1/base", "r2/base"}, "", "m of r2/base and looks along 1.00");
  check({}, " --base-frame r2/base", "m of r2/base and looks along 1.00");
  check({"r1/base", "r2/base"}, " --base-frame r1/base", "to base frame 'r1/base'");
  check({"r1/base"}, "", "to base frame 'base_link'");
}

TEST_F(Tools, PicturesOfEachPair) {
  posesOf(drive_, "--pictures " + in("pictures"));
  for (int i = 0; i < kPairs; ++i)
    EXPECT_EQ(cv::imread(in("pictures/00000" + std::to_string(i) + ".jpg")).size(), cv::Size(320, 240));
  expectError(runSequence("--pictures " + in("pictures")), "is not empty: choose another folder");
}

TEST_F(Tools, PerfectTrajectoryHasNoError) {
  const std::string truth = in("truth.txt");
  const fs::path json = root_ / "errors.json";
  succeed("evaluate_trajectory",
          "--ground-truth " + truth + " --estimate " + truth + " --lengths 0.2,0.4 --json " + json.string());
  const cv::FileStorage errors(json.string(), cv::FileStorage::READ | cv::FileStorage::FORMAT_JSON);
  const cv::FileNode per_length = errors["per_length"];
  ASSERT_EQ(per_length.size(), 2u);
  EXPECT_DOUBLE_EQ(static_cast<double>(per_length[1]["length_m"]), 0.4);
  EXPECT_NEAR(static_cast<double>(per_length[1]["translation_percent"]), 0.0, 1e-9);
  expectError(run("evaluate_trajectory", "--ground-truth " + truth + " --estimate " + in("none")), in("none"));
}

TEST_F(Tools, WhatDiffersIsSaidBeforeHowMuch) {
  std::ofstream late(in("late.txt")), stamped(in("stamped.txt"));
  for (int i = 0; i < 100; ++i)
    for (std::ofstream* file : {&late, &stamped})
      *file << 1700000000000 + 100 * i + (file == &late ? 300 : 0) << " 0 0 " << 0.1 * i + std::sin(0.3 * i) << " 0 0 0 1\n";
  late.close(), stamped.close();
  const std::string files = "--lengths 1 --ground-truth " + in("late.txt") + " --estimate " + in("stamped.txt");
  const Outcome said = succeed("evaluate_trajectory", files);
  EXPECT_LT(said.out.find("differs: stamps of"), said.out.find("differs: clocks are shifted"));
  EXPECT_LT(said.out.find("lack 0.300 s"), said.out.find("ATE"));
  EXPECT_TRUE(contains(succeed("evaluate_trajectory", files + " --offset auto").out, "0.0000"));
  EXPECT_TRUE(contains(succeed("evaluate_trajectory", files + " --offset 0.3").out, "0.0000"));
  expectError(run("evaluate_trajectory", files + " --offset soon"), "soon");
}

}  // namespace sdvo::test_tools
