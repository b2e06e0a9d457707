#include "row_pattern.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cstddef>

#include "../belief/motion_hypotheses.hpp"
#include "right_camera_delay.hpp"

namespace sdvo {
namespace {

std::size_t partOfFeature(const StereoFeatures& features, int i) {
  const StereoCamera& camera = features.camera;
  return static_cast<std::size_t>(RowDelay::partOf(features.u[i], features.v[i], camera.width, camera.height));
}

}  // namespace

/// Medians of dv over a part, because some matches are wrong.
RowPattern::Parts RowPattern::partsOf(const StereoFeatures& features) {
  Parts parts;
  std::array<std::vector<double>, RowDelay::kParts> dv;
  for (int i = 0; i < features.count(); ++i) {
    const std::size_t p = partOfFeature(features, i);
    dv[p].push_back(features.dv[i]);
    parts[p].effect += rotationJacobian(features.camera, features.u[i] - features.disparity[i], features.v[i]).row(1);
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (dv[p].empty()) continue;
    parts[p].weight = static_cast<double>(dv[p].size());
    parts[p].effect /= parts[p].weight;
    std::sort(dv[p].begin(), dv[p].end());
    parts[p].dv = 0.5 * (dv[p][(dv[p].size() - 1) / 2] + dv[p][dv[p].size() / 2]);
  }
  return parts;
}

void RowPattern::learn(const StereoFeatures& features, const std::vector<RowMotion>& rows) {
  const Parts now = partsOf(features);
  std::array<double, RowDelay::kParts> velocity{}, count{};
  for (const RowMotion& row : rows) velocity[row.part] += row.velocity, ++count[row.part];
  for (std::size_t p = 0; p < now.size(); ++p) {
    Part& part = parts_[p];
    part.weight = RowDelay::kMemory * part.weight + now[p].weight;
    if (!(now[p].weight > 0.0)) continue;
    const double ratio = now[p].weight / part.weight;
    part.dv += ratio * (now[p].dv - part.dv);
    if (count[p] > 0.0) part.velocity += ratio * (velocity[p] / count[p] - part.velocity);
    part.effect += ratio * (now[p].effect - part.effect);
  }
}

bool RowPattern::isOfOtherPairs(double dt) const {
  std::vector<RowMotion> rows;
  for (std::size_t p = 0; p < parts_.size(); ++p)
    if (parts_[p].weight > 0.0) rows.push_back({parts_[p].velocity, parts_[p].dv, static_cast<int>(p)});
  if (rows.empty()) return false;
  return kUnsuspected + std::max(logRatioOfDelay(rows, -dt, 0.0), logRatioOfDelay(rows, dt, 0.0)) > 0.0;
}

double RowPattern::change(const StereoFeatures& features, int i) const {
  return features.dv[i] - parts_[partOfFeature(features, i)].dv;
}

std::optional<RightRotation> RowPattern::rotation() const {
  return fit(parts_);
}

std::optional<RightRotation> RowPattern::change(const StereoFeatures& features) const {
  Parts changes = partsOf(features);
  for (std::size_t p = 0; p < changes.size(); ++p) {
    if (!(parts_[p].weight > 0.0)) changes[p].weight = 0.0;
    changes[p].dv -= parts_[p].dv;
  }
  return fit(changes);
}

/// Least squares over the parts, each with the weight of its features.
std::optional<RightRotation> RowPattern::fit(const Parts& parts) {
  constexpr double kFewest = 6.0;  // parts (chosen): three for the rotation, three for its errors
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d product = Eigen::Vector3d::Zero();
  double known = 0.0, weight = 0.0;
  for (const Part& part : parts) {
    if (!(part.weight > 0.0)) continue;
    ++known, weight += part.weight;
    information += part.weight * part.effect.transpose() * part.effect;
    product += part.weight * part.dv * part.effect.transpose();
  }
  if (known < kFewest) return std::nullopt;
  constexpr double kSteady = 1e-3;  // 1/rad^2: keeps the equations solvable if all parts lie in a line
  const Eigen::Matrix3d inverse = (information + kSteady * Eigen::Matrix3d::Identity()).inverse();
  // By a pixel as in rotationByDisparities(): a third of the measurements for each direction.
  RightRotation rotation{inverse * product, Eigen::Matrix3d::Zero(), weight / 3.0 * inverse};
  for (const Part& part : parts) {
    // A residual is smaller than its error by the part's leverage (MacKinnon and White 1985, HC3).
    const double leverage = part.weight * part.effect * inverse * part.effect.transpose();
    const double error = (part.dv - part.effect.dot(rotation.value)) / (1.0 - leverage);
    const Eigen::Vector3d gradient = part.weight * error * part.effect.transpose();
    rotation.covariance += gradient * gradient.transpose();
  }
  rotation.covariance = (inverse * rotation.covariance * inverse).eval();
  return rotation;
}

}  // namespace sdvo
