#include "reference_sequence.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <stdexcept>

#include "../../src/common/progress.hpp"
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

struct OdometryRun {
  Trajectory poses;
  RigCalibration rig;  ///< as found at the end
};

/// The package's own odometry with its default options: the reference must not depend on what the experiment varies.
OdometryRun runOdometry(const KittiSequence& images, int frames, const std::string& name) {
  const PipelineOptions options;
  const FeatureExtractor extractor(options.stereo_features);
  VisualOdometry odometry(options.visual_odometry);
  OdometryRun run;
  Progress progress("reference odometry " + name, frames);
  for (int i = 0; i < frames; ++i, progress.step()) {
    const ImagePair pair = images.load(i);
    const OdometryResult result =
        odometry.update(extractor.extract(images.camera(), pair.left, pair.right, images.stamp(i)));
    if (!result.has_pose || result.epoch != 0)
      throw std::runtime_error("the reference odometry loses " + images.directory() + " at pair " + std::to_string(i) +
                               "; use --reference ground_truth");
    run.poses.push_back(result.T_origin_camera);
    if (std::isfinite(result.disparity_offset)) run.rig.value = {result.disparity_offset, result.disparity_bend, 0.0};
  }
  return run;
}

}  // namespace

ReferenceSequence openImages(const ExperimentSetup& setup, const std::string& name) {
  const std::string directory = sequenceDirectory(setup, name);
  std::filesystem::path path(directory);
  if (!path.has_filename()) path = path.parent_path();
  ReferenceSequence sequence{path.filename().string(), KittiSequence(directory), 0, {}};
  sequence.frames = sequence.images.size();
  if (setup.frames > 0) sequence.frames = std::min(setup.frames, sequence.frames);
  return sequence;
}

ReferenceSequence openSequence(const ExperimentSetup& setup, const std::string& name, ReferenceMotion reference) {
  ReferenceSequence sequence = openImages(setup, name);
  sequence.trajectory = reference == ReferenceMotion::kGroundTruth
                            ? groundTruth(sequence.images.directory(), sequence.frames)
                            : runOdometry(sequence.images, sequence.frames, sequence.name).poses;
  return sequence;
}

RigCalibration estimateRig(const ReferenceSequence& sequence) {
  return runOdometry(sequence.images, sequence.frames, sequence.name).rig;
}

}  // namespace sdvo
