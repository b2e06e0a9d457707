// Learns which of the 903 field pairs become FREAK's 512 bits, by the procedure of Alahi et al. 2012, section 4.2:
// pairs are ranked by how evenly they split a large set of key points, then taken greedily if they correlate little
// with those already taken.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <sstream>
#include <stdexcept>

#include "../../src/data/text_file.hpp"
#include "../../src/front_end/feature_detector.hpp"
#include "../../src/front_end/freak.hpp"
#include "learn.hpp"

namespace {

using sdvo::Freak;
using sdvo::ViewKeypoint;

/// One bit for each key point, packed; a column of the paper's matrix D.
struct Column {
  Freak::FieldPair pair;
  std::vector<std::uint64_t> bits;
  double mean = 0.0;
};

double popcount(const std::vector<std::uint64_t>& a, const std::vector<std::uint64_t>& b) {
  std::int64_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += __builtin_popcountll(a[i] & b[i]);
  return static_cast<double>(count);
}

/// Receptive field intensities of corners at sizes spread evenly in logarithm over the range the odometry uses.
std::vector<std::array<float, Freak::kFields>> sampleKeypoints(const std::vector<std::string>& files, int per_image,
                                                               std::uint32_t seed) {
  sdvo::FeatureDetectorOptions options;
  options.max_features = per_image;
  const sdvo::FeatureDetector detector(options);
  std::mt19937 random(seed);
  std::vector<std::array<float, Freak::kFields>> samples;
  for (const std::string& file : files) {
    const cv::Mat image = cv::imread(file, cv::IMREAD_GRAYSCALE);
    if (image.empty()) throw std::runtime_error("'" + file + "' is no image that OpenCV can read");
    const Freak freak(image);
    for (const sdvo::Corner& corner : detector.detect(image)) {
      const double fraction = static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
      const ViewKeypoint keypoint{corner.position.x, corner.position.y,
                                  static_cast<float>(7.0 * std::pow(30.0 / 7.0, fraction)), -1.f};
      if (Freak::fits(keypoint, image.size())) samples.push_back(freak.intensities(keypoint));
    }
  }
  return samples;
}

std::vector<Column> makeColumns(const std::vector<std::array<float, Freak::kFields>>& samples) {
  std::vector<Column> columns;
  for (std::uint8_t i = 1; i < Freak::kFields; ++i)
    for (std::uint8_t j = 0; j < i; ++j) {
      const Freak::FieldPair pair(i, j);
      Column column{pair, std::vector<std::uint64_t>((samples.size() + 63) / 64, 0), 0.0};
      for (std::size_t s = 0; s < samples.size(); ++s)
        if (samples[s][pair.first] > samples[s][pair.second]) column.bits[s / 64] |= std::uint64_t{1} << (s % 64);
      column.mean = popcount(column.bits, column.bits) / static_cast<double>(samples.size());
      columns.push_back(std::move(column));
    }
  return columns;
}

double correlation(const Column& a, const Column& b, double samples) {
  const double variance = a.mean * (1.0 - a.mean) * b.mean * (1.0 - b.mean);
  if (variance <= 0.0) return 1.0;
  return std::abs(popcount(a.bits, b.bits) / samples - a.mean * b.mean) / std::sqrt(variance);
}

/// Greedy choice; the admissible correlation is raised until enough columns are found.
std::vector<Column> choose(std::vector<Column> columns, double samples, double& max_correlation) {
  std::stable_sort(columns.begin(), columns.end(),
                   [](const Column& a, const Column& b) { return std::abs(a.mean - 0.5) < std::abs(b.mean - 0.5); });
  for (;; max_correlation += 0.01) {
    std::vector<Column> chosen;
    for (const Column& candidate : columns) {
      const bool independent = std::all_of(chosen.begin(), chosen.end(), [&](const Column& taken) {
        return correlation(candidate, taken, samples) < max_correlation;
      });
      if (independent) chosen.push_back(candidate);
      if (chosen.size() == Freak::kBits) return chosen;
    }
    if (max_correlation > 1.0) throw std::runtime_error("the samples do not tell 512 pairs apart, give more images");
  }
}

struct Arguments {
  std::vector<std::string> images;
  std::string output;
  int per_image = 600;
  double max_correlation = 0.5;
  std::uint32_t seed = 1;
};

int run(Arguments arguments) {
  const auto samples = sampleKeypoints(arguments.images, arguments.per_image, arguments.seed);
  if (samples.size() < 1000)
    throw std::runtime_error("only " + std::to_string(samples.size()) +
                             " key points were found, too few: give more images");
  const std::vector<Column> chosen =
      choose(makeColumns(samples), static_cast<double>(samples.size()), arguments.max_correlation);

  std::ostringstream file;
  file << "// Learnt by learn freak-pairs from " << samples.size() << " key points in " << arguments.images.size()
       << " images; largest correlation " << arguments.max_correlation << ".\n";
  for (std::size_t i = 0; i < chosen.size(); ++i)
    file << "{" << int{chosen[i].pair.first} << ", " << int{chosen[i].pair.second} << "},"
         << (i % 12 == 11 ? "\n" : " ");
  file << "\n";
  sdvo::writeTextFile(arguments.output, file.str());
  std::cout << samples.size() << " key points, largest correlation " << arguments.max_correlation
            << ", mean of the last pair " << chosen.back().mean << ", written to " << arguments.output << "\n";
  return 0;
}

}  // namespace

namespace sdvo {

Learning addFreakPairs(CLI::App& app) {
  const auto of_command = std::make_shared<Arguments>();
  Arguments& arguments = *of_command;
  app.add_option("images", arguments.images, "training images")->required();
  app.add_option("--output", arguments.output, "file to write, src/front_end/freak_pairs.inc of this package")
      ->required();
  app.add_option("--per-image", arguments.per_image, "corners sampled in each image")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  app.add_option("--max-correlation", arguments.max_correlation, "first admissible correlation")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 1.0));
  app.add_option("--seed", arguments.seed, "seed of the sizes")->capture_default_str();
  return [of_command] { return run(*of_command); };
}

}  // namespace sdvo
