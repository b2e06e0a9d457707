#include "ground_map.hpp"

#include <algorithm>
#include <cmath>

namespace sdvo::render {

namespace {

constexpr double kExtension = 160.0;  // m of road beyond both ends of the way
constexpr double kRevisit = 9.0;      // parts of the way closer than this share one ground, m
constexpr double kBlend = 30.0;       // way over which the ground changes from one height to the other, m

double smoothStep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

/// Share 0 … 1 of the segment a → b that is nearest to p.
double nearestShare(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& p) {
  const Eigen::Vector2d ab = b - a;
  const double squared = ab.squaredNorm();
  return squared > 0.0 ? std::clamp(ab.dot(p - a) / squared, 0.0, 1.0) : 0.0;
}

}  // namespace

RoadLine::RoadLine(const DrivePath& path, double camera_height) {
  std::vector<Sample> way;
  const auto append = [&](const Eigen::Isometry3d& pose) {
    const Eigen::Vector3d position = pose.translation(), forward = pose.linear().col(2);
    way.push_back(
        {position.x(), position.z(), position.y() + camera_height, std::atan2(forward.x(), forward.z()), 0.0});
  };
  append(path.pose(0));
  for (const Eigen::Isometry3d& pose : path.poses()) {
    if (std::hypot(pose.translation().x() - way.back().x, pose.translation().z() - way.back().z) >= 1.0) append(pose);
  }
  for (std::size_t i = 1; i < way.size(); ++i)
    way[i].distance = way[i - 1].distance + std::hypot(way[i].x - way[i - 1].x, way[i].z - way[i - 1].z);

  // The heading of the way itself: a camera may look elsewhere.
  if (way.size() > 1)
    for (std::size_t i = 0; i < way.size(); ++i) {
      const Sample& before = way[i > 0 ? i - 1 : 0];
      const Sample& after = way[std::min(i + 1, way.size() - 1)];
      way[i].heading = std::atan2(after.x - before.x, after.z - before.z);
    }

  // Where the way comes by again the ground must lie below both visits: raise = how far it sinks below its own.
  std::vector<double> sink(way.size(), 0.0);
  for (std::size_t i = 0; i < way.size(); ++i)
    for (std::size_t j = 0; j < way.size(); ++j) {
      if (std::abs(way[i].distance - way[j].distance) < 5.0 * kRevisit) continue;
      if (std::hypot(way[i].x - way[j].x, way[i].z - way[j].z) < kRevisit)
        sink[i] = std::max(sink[i], way[j].height - way[i].height);
    }
  std::vector<double> smooth(way.size(), 0.0);
  for (std::size_t j = 0; j < way.size(); ++j) {
    if (sink[j] == 0.0) continue;
    for (std::size_t i = 0; i < way.size(); ++i) {
      const double gap = std::abs(way[i].distance - way[j].distance);
      if (gap < kBlend) smooth[i] = std::max(smooth[i], sink[j] * smoothStep(1.5 * (1.0 - gap / kBlend)));
    }
  }
  for (std::size_t i = 0; i < way.size(); ++i) way[i].height += smooth[i];

  const auto nearOtherPart = [&](const Sample& sample, double from) {
    return std::any_of(way.begin(), way.end(), [&](const Sample& other) {
      return std::abs(other.distance - from) > 40.0 && std::hypot(other.x - sample.x, other.z - sample.z) < 20.0;
    });
  };
  const auto extended = [&](const Sample& end, double direction) {
    std::vector<Sample> extension;
    for (double step = 1.0; step <= kExtension; step += 1.0) {
      Sample sample = end;
      sample.x += direction * step * std::sin(end.heading);
      sample.z += direction * step * std::cos(end.heading);
      sample.distance += direction * step;
      if (nearOtherPart(sample, end.distance)) break;
      extension.push_back(sample);
    }
    return extension;
  };
  const std::vector<Sample> before = extended(way.front(), -1.0), after = extended(way.back(), 1.0);
  samples_.assign(before.rbegin(), before.rend());
  samples_.insert(samples_.end(), way.begin(), way.end());
  samples_.insert(samples_.end(), after.begin(), after.end());
}

RoadLine::Sample RoadLine::at(double distance) const {
  const auto next = std::lower_bound(samples_.begin(), samples_.end(), distance,
                                     [](const Sample& sample, double value) { return sample.distance < value; });
  if (next == samples_.begin()) return samples_.front();
  if (next == samples_.end()) return samples_.back();
  const Sample &a = *(next - 1), &b = *next;
  const double share = (distance - a.distance) / (b.distance - a.distance);
  const double turn = std::remainder(b.heading - a.heading, 2.0 * M_PI);
  return {a.x + share * (b.x - a.x), a.z + share * (b.z - a.z), a.height + share * (b.height - a.height),
          a.heading + share * turn, distance};
}

Eigen::Vector2d RoadLine::beside(double distance, double lateral) const {
  const Sample sample = at(distance);
  return {sample.x + lateral * std::cos(sample.heading), sample.z - lateral * std::sin(sample.heading)};
}

GroundMap::GroundMap(const RoadLine& road) {
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (const RoadLine::Sample& sample : road.samples()) {
    low = low.cwiseMin(Eigen::Vector2d(sample.x, sample.z));
    high = high.cwiseMax(Eigen::Vector2d(sample.x, sample.z));
  }
  const double margin = kReach + 2.0 * kCell;
  origin_ = low.array() - margin;
  columns_ = static_cast<int>((high.x() - low.x() + 2.0 * margin) / kCell) + 1;
  rows_ = static_cast<int>((high.y() - low.y() + 2.0 * margin) / kCell) + 1;
  nodes_.resize(static_cast<std::size_t>(columns_) * rows_);
  stamp(road);
  smoothHeights();
}

void GroundMap::stamp(const RoadLine& road) {
  const std::vector<RoadLine::Sample>& samples = road.samples();
  for (std::size_t i = 0; i + 1 < samples.size(); ++i) {
    const RoadLine::Sample &from = samples[i], &to = samples[i + 1];
    const Eigen::Vector2d a(from.x, from.z), b(to.x, to.z);
    const Eigen::Vector2d left_a(from.x - kRoadOffset * std::cos(from.heading),
                                 from.z + kRoadOffset * std::sin(from.heading));
    const Eigen::Vector2d left_b(to.x - kRoadOffset * std::cos(to.heading), to.z + kRoadOffset * std::sin(to.heading));
    // Far away every fourth segment is enough: there only the height and the rough distance matter.
    const double reach = i % 4 == 0 ? kReach + 3.0 : 24.0;
    const int first_column = std::max(0, static_cast<int>((a.x() - reach - origin_.x()) / kCell));
    const int last_column = std::min(columns_ - 1, static_cast<int>((a.x() + reach - origin_.x()) / kCell));
    const int first_row = std::max(0, static_cast<int>((a.y() - reach - origin_.y()) / kCell));
    const int last_row = std::min(rows_ - 1, static_cast<int>((a.y() + reach - origin_.y()) / kCell));
    for (int row = first_row; row <= last_row; ++row)
      for (int column = first_column; column <= last_column; ++column) {
        const Eigen::Vector2d p = position(row, column);
        Node& here = node(row, column);
        const double share = nearestShare(a, b, p);
        const Eigen::Vector2d offset = p - (a + share * (b - a));
        const double distance = offset.norm();
        if (distance < here.path) {
          here.path = static_cast<float>(distance);
          const double side = (b - a).y() * offset.x() - (b - a).x() * offset.y();
          here.lateral = static_cast<float>(side >= 0.0 ? distance : -distance);
          here.along = static_cast<float>(from.distance + share * (to.distance - from.distance));
          here.height = static_cast<float>(from.height + share * (to.height - from.height));
        }
        const double left_share = nearestShare(left_a, left_b, p);
        here.road = std::min(here.road, static_cast<float>((p - (left_a + left_share * (left_b - left_a))).norm()));
      }
  }
}

void GroundMap::smoothHeights() {
  std::vector<float> heights(nodes_.size());
  for (int pass = 0; pass < 3; ++pass) {
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column) {
        float sum = 0.0f;
        int count = 0;
        for (int r = std::max(0, row - 1); r <= std::min(rows_ - 1, row + 1); ++r)
          for (int c = std::max(0, column - 1); c <= std::min(columns_ - 1, column + 1); ++c)
            if (node(r, c).path < 1e5f) {
              sum += node(r, c).height;
              ++count;
            }
        heights[static_cast<std::size_t>(row) * columns_ + column] = count > 0 ? sum / static_cast<float>(count) : 0.0f;
      }
    for (std::size_t i = 0; i < nodes_.size(); ++i) nodes_[i].height = heights[i];
  }
}

GroundMap::Place GroundMap::at(double x, double z) const {
  const double column = std::clamp((x - origin_.x()) / kCell, 0.0, columns_ - 1.001);
  const double row = std::clamp((z - origin_.y()) / kCell, 0.0, rows_ - 1.001);
  const int c = static_cast<int>(column), r = static_cast<int>(row);
  const auto wc = static_cast<float>(column - c), wr = static_cast<float>(row - r);
  const Node &n00 = node(r, c), &n01 = node(r, c + 1), &n10 = node(r + 1, c), &n11 = node(r + 1, c + 1);
  const auto blend = [&](float Node::*field) {
    const float upper = n00.*field + wc * (n01.*field - n00.*field);
    const float lower = n10.*field + wc * (n11.*field - n10.*field);
    return upper + wr * (lower - upper);
  };
  Place result;
  result.height = blend(&Node::height);
  result.path = blend(&Node::path);
  result.road = blend(&Node::road);
  const auto spread = [&](float Node::*field) {
    return std::max({n00.*field, n01.*field, n10.*field, n11.*field}) -
           std::min({n00.*field, n01.*field, n10.*field, n11.*field});
  };
  const bool seam = spread(&Node::along) > 5.0f * kCell || spread(&Node::lateral) > 3.0f * kCell;
  if (seam) {
    const Node& nearest = node(wr < 0.5f ? r : r + 1, wc < 0.5f ? c : c + 1);
    result.lateral = nearest.lateral;
    result.along = nearest.along;
  } else {
    result.lateral = blend(&Node::lateral);
    result.along = blend(&Node::along);
  }
  result.mixed = seam;
  const auto per_metre = static_cast<float>(1.0 / kCell);
  result.road_gradient = per_metre * Eigen::Vector2f((1.0f - wr) * (n01.road - n00.road) + wr * (n11.road - n10.road),
                                                     (1.0f - wc) * (n10.road - n00.road) + wc * (n11.road - n01.road));
  return result;
}

}  // namespace sdvo::render
