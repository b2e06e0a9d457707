#include "ground_truth.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "../data/text_file.hpp"

namespace sdvo {
namespace {

/// TUM's lines have eight words, or begin with a comment; KITTI's have twelve.
bool hasStamps(const std::string& path) {
  std::ifstream file = openTextFile(path);
  std::string line;
  while (std::getline(file, line))
    if (const std::vector<std::string> words = splitWords(line); !words.empty())
      return words.front().front() == '#' || words.size() == 8;
  return false;
}

/// Poses further apart than this (ns) are not interpolated: the motion between them may be anything.
constexpr std::int64_t kLongestGap = 500000000;

std::optional<Eigen::Isometry3d> interpolated(const StampedTrajectory& truth, std::int64_t stamp) {
  const auto next = std::lower_bound(truth.stamps.begin(), truth.stamps.end(), stamp);
  if (next == truth.stamps.end()) return std::nullopt;
  const auto after = static_cast<std::size_t>(std::distance(truth.stamps.begin(), next));
  if (*next == stamp) return truth.poses[after];
  if (after == 0 || *next - truth.stamps[after - 1] > kLongestGap) return std::nullopt;
  const Eigen::Isometry3d &from = truth.poses[after - 1], &to = truth.poses[after];
  const double part =
      static_cast<double>(stamp - truth.stamps[after - 1]) / static_cast<double>(*next - truth.stamps[after - 1]);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(from.linear()).slerp(part, Eigen::Quaterniond(to.linear())).toRotationMatrix();
  pose.translation() = (1.0 - part) * from.translation() + part * to.translation();
  return pose;
}

}  // namespace

std::vector<std::optional<Eigen::Isometry3d>> readGroundTruth(const std::string& path,
                                                              const std::vector<std::int64_t>& stamps) {
  if (!hasStamps(path)) {
    const Trajectory poses = readKittiPoses(path);
    if (poses.size() < stamps.size())
      throw std::runtime_error("file '" + path + "' has " + std::to_string(poses.size()) + " poses for " +
                               std::to_string(stamps.size()) + " pairs: one line for each is needed, or TUM's format");
    return {poses.begin(), poses.begin() + static_cast<std::ptrdiff_t>(stamps.size())};
  }
  const StampedTrajectory truth = readTumPoses(path);
  std::vector<std::optional<Eigen::Isometry3d>> poses;
  for (const std::int64_t stamp : stamps) poses.push_back(interpolated(truth, stamp));
  if (std::count_if(poses.begin(), poses.end(), [](const auto& pose) { return pose.has_value(); }) < 2)
    throw std::runtime_error("file '" + path + "' has no poses at the stamps of the recording");
  return poses;
}

}  // namespace sdvo
