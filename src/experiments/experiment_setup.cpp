#include "experiment_setup.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <stdexcept>

#include "../common/progress.hpp"
#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace sdvo {
namespace {

std::string sequenceDirectory(const ExperimentSetup& setup, const std::string& name) {
  const std::filesystem::path official = std::filesystem::path(setup.kitti) / "sequences" / name;
  if (!setup.kitti.empty() && std::filesystem::is_directory(official)) return official.string();
  if (std::filesystem::is_directory(name)) return name;
  throw std::runtime_error("sequence " + name + " is neither a directory nor below " + setup.kitti +
                           "/sequences; give --kitti the directory of the KITTI odometry data");
}

Trajectory groundTruth(const std::string& directory, int frames) {
  const std::optional<std::string> file = findKittiPoses(directory);
  if (!file) throw std::runtime_error(directory + " has no ground truth poses; use --reference odometry");
  Trajectory poses = readKittiPoses(*file);
  if (static_cast<int>(poses.size()) < frames)
    throw std::runtime_error(*file + " has only " + std::to_string(poses.size()) + " poses for " +
                             std::to_string(frames) + " pairs");
  poses.resize(static_cast<std::size_t>(frames));
  return poses;
}

/// The package's own odometry with its default options: the reference must not depend on what the experiment varies.
Trajectory runOdometry(const KittiSequence& images, int frames, const std::string& name) {
  const PipelineOptions options;
  const FeatureExtractor extractor(options.stereo_features);
  VisualOdometry odometry(options.visual_odometry);
  Trajectory poses;
  Progress progress("reference odometry " + name, frames);
  for (int i = 0; i < frames; ++i, progress.step()) {
    const ImagePair pair = images.load(i);
    const OdometryResult result =
        odometry.update(extractor.extract(images.camera(), pair.left, pair.right, images.stamp(i)));
    if (!result.has_pose || result.epoch != 0)
      throw std::runtime_error("the reference odometry loses " + images.directory() + " at pair " + std::to_string(i) +
                               "; use --reference ground_truth");
    poses.push_back(result.T_origin_camera);
  }
  return poses;
}

}  // namespace

PipelineOptions ExperimentSetup::options() const {
  // A loose threshold, as in the paper: weak corners belong to the large feature sets.
  // Near features, whose scale changes most, are large and at the image borders: they must not be left out.
  std::vector<std::string> loose = {"stereo_features/detector/max_features=12000", "detector/fast_min_threshold=3",
                                    "detector/corner_quality=0.0002", "descriptor/extend_border=true"};
  // What fit_depth_scale found on a rendered drive, see docs/experiments.md. The odometry's own defaults differ: it
  // gains nothing from large neighbourhoods, which cost it time.
  for (const char* curve : {"size_curve/slope=0.7", "size_curve/min_size=14", "size_curve/max_size=60"})
    loose.emplace_back(curve);
  loose.insert(loose.end(), settings.begin(), settings.end());
  return readPipelineOptions("", loose);
}

ReferenceSequence openImages(const ExperimentSetup& setup, const std::string& name) {
  const std::string directory = sequenceDirectory(setup, name);
  std::filesystem::path path(directory);
  if (!path.has_filename()) path = path.parent_path();
  ReferenceSequence sequence{path.filename().string(), KittiSequence(directory), 0, {}};
  sequence.frames = sequence.images.size();
  if (setup.frames > 0) sequence.frames = std::min(setup.frames, sequence.frames);
  return sequence;
}

ReferenceSequence openSequence(const ExperimentSetup& setup, const std::string& name, const std::string& reference) {
  ReferenceSequence sequence = openImages(setup, name);
  sequence.trajectory = reference == "ground_truth" ? groundTruth(sequence.images.directory(), sequence.frames)
                                                    : runOdometry(sequence.images, sequence.frames, sequence.name);
  return sequence;
}

std::vector<FeatureMatch> matchByDescriptor(const StereoFeatures& reference, const StereoFeatures& current) {
  FeatureMatcherOptions options;
  options.gating = false;
  options.max_distance = 1.0;
  return FeatureMatcher(options).match(reference, current, std::nullopt);
}

int countCorrect(const StereoFeatures& reference, const StereoFeatures& current,
                 const std::vector<FeatureMatch>& matches, const Eigen::Isometry3d& T_current_reference) {
  constexpr double kLargestError = 3.0;   // px
  constexpr double kNearestDepth = 0.05;  // m
  int correct = 0;
  for (const FeatureMatch& match : matches) {
    const Eigen::Vector3d point = T_current_reference * reference.point(match.reference);
    if (point.z() < kNearestDepth) continue;
    const Eigen::Vector3d predicted = current.camera.project(point);
    const Eigen::Vector3d measured = current.measurement(match.current);
    if (std::hypot(predicted.x() - measured.x(), predicted.y() - measured.y()) <= kLargestError) ++correct;
  }
  return correct;
}

}  // namespace sdvo
