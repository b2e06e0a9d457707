#include "drive_path.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace sdvo::render {

DrivePath::DrivePath(std::vector<Eigen::Isometry3d> poses, double rate, int steps)
    : poses_(std::move(poses)), rate_(rate), steps_(steps) {
  if (poses_.empty()) throw std::invalid_argument("a drive needs at least one pose");
  distances_.push_back(0.0);
  for (std::size_t i = 1; i < poses_.size(); ++i) {
    const Eigen::Vector3d step = poses_[i].translation() - poses_[i - 1].translation();
    distances_.push_back(distances_.back() + std::hypot(step.x(), step.z()));
  }
}

Eigen::Isometry3d DrivePath::poseAt(double time) const {
  const auto last = static_cast<int>(poses_.size()) - 1;
  if (last == 0) return poses_.front();
  const double index = time * rate_ * steps_;
  const int i = std::clamp(static_cast<int>(std::floor(index)), 0, last - 1);
  const double share = index - i;
  const Eigen::Isometry3d& before = poses_[static_cast<std::size_t>(i)];
  const Eigen::Isometry3d& after = poses_[static_cast<std::size_t>(i) + 1];
  if (share == 0.0) return before;
  const Eigen::AngleAxisd turn(before.linear().transpose() * after.linear());
  Eigen::Isometry3d result = before;
  result.linear() = before.linear() * Eigen::AngleAxisd(share * turn.angle(), turn.axis()).toRotationMatrix();
  result.translation() += share * (after.translation() - before.translation());
  return result;
}

double DrivePath::distanceAt(double time) const {
  const auto last = static_cast<int>(poses_.size()) - 1;
  if (last == 0) return 0.0;
  const double index = std::clamp(time * rate_ * steps_, 0.0, static_cast<double>(last));
  const int i = std::min(static_cast<int>(index), last - 1);
  return distances_[i] + (index - i) * (distances_[i + 1] - distances_[i]);
}

}  // namespace sdvo::render
