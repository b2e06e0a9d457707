// Trajectories, KITTI's and TUM's: poses that are rigid come out, or one std::runtime_error.
#include <stdexcept>

#include "fuzz_file.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace {

void requireRigid(const sdvo::Trajectory& poses) {
  for (const Eigen::Isometry3d& pose : poses)
    if (!pose.matrix().allFinite() || !pose.linear().isUnitary(1e-6) || pose.linear().determinant() < 0.0)
      __builtin_trap();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string path = sdvo::fuzzedFile("poses.txt", data, size);
  try {
    requireRigid(sdvo::readKittiPoses(path));
  } catch (const std::runtime_error&) {
  }
  try {
    const sdvo::StampedTrajectory trajectory = sdvo::readPoses(path);
    requireRigid(trajectory.poses);
    if (!trajectory.stamps.empty() && trajectory.stamps.size() != trajectory.poses.size()) __builtin_trap();
  } catch (const std::runtime_error&) {
  }
  return 0;
}
