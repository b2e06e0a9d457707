#include <cmath>
#include <cstdio>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "../data/text_file.hpp"
#include "../data/trajectory_comparison.hpp"
#include "run_tool.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace {

using sdvo::SubPathErrors;
using sdvo::TrajectoryErrors;

std::string format(const char* pattern, double value) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

/// "-" for a quantity without samples.
std::string cell(const char* pattern, double value) {
  return std::isnan(value) ? "-" : format(pattern, value);
}

/// Of the whole trajectory.
struct Figure {
  const char *name, *words, *pattern;
  double TrajectoryErrors::*value;
};

const Figure kFigures[] = {
    {"rpe_translation_m", "RPE translation, rmse per frame [m]", "%.5f", &TrajectoryErrors::rpe_translation_m},
    {"rpe_rotation_deg", "RPE rotation, rmse per frame [deg]", "%.5f", &TrajectoryErrors::rpe_rotation_deg},
    {"ate_aligned_m", "ATE, rmse after rigid alignment [m]", "%.4f", &TrajectoryErrors::ate_aligned_m},
    {"ate_first_pose_m", "ATE, rmse with equal first poses [m]", "%.4f", &TrajectoryErrors::ate_first_pose_m},
    {"final_drift_m", "final drift [m]", "%.4f", &TrajectoryErrors::final_drift_m},
    {"final_drift_percent", "final drift [% of length]", "%.4f", &TrajectoryErrors::final_drift_percent},
    {"final_drift_deg", "final drift [deg]", "%.4f", &TrajectoryErrors::final_drift_deg},
    {"largest_drift_m", "largest drift [m]", "%.4f", &TrajectoryErrors::largest_drift_m},
    {"largest_drift_deg", "largest drift [deg]", "%.4f", &TrajectoryErrors::largest_drift_deg},
    {"scale", "scale, median of estimated / true step", "%.5f", &TrajectoryErrors::scale},
};

void printRow(const std::string& name, const SubPathErrors& errors) {
  std::printf("%10s %10d %15s %18s\n", name.c_str(), errors.count, cell("%.4f", errors.translation_percent).c_str(),
              cell("%.5f", errors.rotation_deg_per_m).c_str());
}

void printTable(const TrajectoryErrors& errors) {
  std::printf("%d frames, %.2f m along the ground truth\n\n", errors.frames, errors.path_length);
  std::printf("%10s %10s %15s %18s\n", "length [m]", "sub-paths", "translation [%]", "rotation [deg/m]");
  for (const SubPathErrors& row : errors.per_length) printRow(format("%g", row.length), row);
  printRow("mean", errors.sub_paths);
  std::printf("\n");

  for (const Figure& figure : kFigures)
    std::printf("%-44s %s\n", figure.words, cell(figure.pattern, errors.*figure.value).c_str());
}

/// Requested lengths that are longer than the path, as "100, 200"; empty without any.
std::string missingLengths(const TrajectoryErrors& errors) {
  std::string text;
  for (const SubPathErrors& row : errors.per_length) {
    if (row.count == 0) text += (text.empty() ? "" : ", ") + format("%g", row.length);
  }
  return text;
}

std::string jsonNumber(double value) {
  return std::isfinite(value) ? format("%.12g", value) : "null";
}

/// As a string of JSON.
std::string quoted(const std::string& text) {
  std::string quoted;
  for (const char c : text) quoted += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return quoted;
}

std::string jsonSubPaths(const SubPathErrors& errors) {
  return "\"sub_paths\": " + std::to_string(errors.count) +
         ", \"translation_percent\": " + jsonNumber(errors.translation_percent) +
         ", \"rotation_deg_per_m\": " + jsonNumber(errors.rotation_deg_per_m);
}

void writeJson(const std::string& path, const TrajectoryErrors& errors, const std::vector<std::string>& differences) {
  std::ostringstream file;
  file << "{ \"differences\": [";
  for (const std::string& difference : differences)
    file << (&difference == &differences.front() ? "" : ", ") << '"' << quoted(difference) << '"';
  file << "],\n  \"frames\": " << errors.frames << ",\n  \"path_length_m\": " << jsonNumber(errors.path_length)
       << ",\n  \"mean\": {" << jsonSubPaths(errors.sub_paths) << "},\n  \"per_length\": [";
  const char* separator = "\n";
  for (const SubPathErrors& row : errors.per_length) {
    file << separator << "    {\"length_m\": " << jsonNumber(row.length) << ", " << jsonSubPaths(row) << "}";
    separator = ",\n";
  }
  file << "\n  ]";
  for (const Figure& figure : kFigures) file << ",\n  \"" << figure.name << "\": " << jsonNumber(errors.*figure.value);
  file << "\n}\n";
  sdvo::writeTextFile(path, file.str());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Errors of an estimated trajectory: KITTI translation and rotation errors over sub-paths, RPE, ATE, final drift "
      "and scale. Poses of both files belong together by their stamps; without stamps by their lines, and a shorter "
      "estimate is compared with the first poses of the ground truth. Says first how the files differ: units and "
      "clocks of stamps, shifted lines, bodies (a marker, an IMU) and worlds.");
  std::string ground_truth, estimate, json, offset;
  sdvo::ComparisonOptions options;
  std::vector<double> lengths = sdvo::kittiLengths();
  app.add_option("--ground-truth", ground_truth,
                 "True poses: KITTI's format (12 numbers a line), TUM's, EuRoC's or another CSV with a head, TartanAir's")
      ->required();
  app.add_option("--estimate", estimate, "Estimated poses in one of these formats")->required();
  app.add_option("--lengths", lengths, "Lengths of the sub-paths in m, e.g. 5,10,20 (default 100,200,...,800)")
      ->delimiter(',');
  app.add_flag("--align", options.align, "Moves the estimate to the truth's body, by the constant transform that is said");
  app.add_option("--offset", offset,
                 "Added to the estimate's stamps, s, or auto: the shift in time, or of lines, that is said");
  app.add_option("--json", json, "Also write the errors to this file");

  return sdvo::runTool(app, argc, argv, [&] {
    options.find_offset = offset == "auto";
    if (!offset.empty() && !options.find_offset) options.offset = sdvo::parseNumber(offset);
    const auto [truth, estimated, differences] = sdvo::compareTrajectories(ground_truth, estimate, options);
    for (const std::string& difference : differences) std::printf("differs: %s\n", difference.c_str());
    if (!differences.empty()) std::printf("\n");
    const TrajectoryErrors errors = sdvo::evaluateTrajectory(truth, estimated, lengths);
    printTable(errors);
    std::fflush(stdout);
    if (!json.empty()) writeJson(json, errors, differences);
    const std::string missing = missingLengths(errors);
    if (errors.sub_paths.count == 0) {
      throw std::runtime_error("no sub-path of " + missing + " m fits into the " + format("%.2f", errors.path_length) +
                               " m of ground truth: choose shorter --lengths");
    }
    if (!missing.empty()) {
      std::cerr << "note: no sub-path of " << missing << " m fits into the " << format("%.2f", errors.path_length)
                << " m of ground truth" << std::endl;
    }
    return 0;
  });
}
