#include "view_renderer.hpp"

#include <array>
#include <limits>
#include <stdexcept>

namespace sdvo::render {

namespace {

struct Offset {
  float x, y;
};

/// Evenly spread sample positions within a pixel whose mean is its centre; no two share a row or a column.
std::array<Offset, 16> samplePattern(int samples, float offset_x, float offset_y) {
  std::array<Offset, 16> pattern{};
  if (samples == 1) {
    pattern.fill({offset_x, offset_y});
  } else if (samples == 4) {
    pattern = {{{-0.125f, -0.375f}, {0.375f, -0.125f}, {-0.375f, 0.125f}, {0.125f, 0.375f}}};
  } else if (samples == 16) {
    for (int i = 0; i < 16; ++i)
      pattern[i] = {(static_cast<float>(i % 4 * 4 + i / 4) + 0.5f) / 16.0f - 0.5f,
                    (static_cast<float>(i / 4 * 4 + i % 4) + 0.5f) / 16.0f - 0.5f};
  } else {
    throw std::invalid_argument("samples per pixel must be 1, 4 or 16");
  }
  return pattern;
}

/// Samples of one pixel that met the same surface.
struct Group {
  int car;
  std::uint32_t quad;
  bool ground;
  int count;
  float depth, u, v;
};

/// Rays of a view in single precision.
struct RayBase {
  explicit RayBase(const View& view)
      : origin(view.T_world_camera.translation().cast<float>()),
        corner(view.direction(0.0, 0.0)),
        step_x(view.T_world_camera.linear().col(0) / view.fx),
        step_y(view.T_world_camera.linear().col(1) / view.fy) {}
  Eigen::Vector3f direction(double u, double v) const { return (corner + u * step_x + v * step_y).cast<float>(); }

  Eigen::Vector3f origin;
  Eigen::Vector3d corner, step_x, step_y;
};

}  // namespace

void ViewRenderer::add(const View& view, const MovingScene& cars, int samples, float offset_x, float offset_y,
                       float weight, cv::Mat1f& image) const {
  const std::array<Offset, 16> pattern = samplePattern(samples, offset_x, offset_y);
  const int block = samples == 1 ? 4 : samples == 4 ? 2 : 1;
  const RayBase base(view);
  const Eigen::Vector3f step_x = base.step_x.cast<float>(), step_y = base.step_y.cast<float>();
  const float share = weight / static_cast<float>(samples);

  RayPacket packet;
  std::array<Group, 16> groups;
  for (int top = 0; top < view.height; top += block)
    for (int left = 0; left < view.width; left += block) {
      for (int i = 0; i < RayPacket::kSize; ++i) {
        const int pixel = i / samples, row = top + pixel / block, column = left + pixel % block;
        if (row < view.height && column < view.width)
          packet.set(i, base.origin, base.direction(column + pattern[i % samples].x, row + pattern[i % samples].y));
        else
          packet.disable(i);
      }
      caster_->cast(packet);
      cars.cast(packet);

      for (int pixel = 0; pixel < block * block; ++pixel) {
        const int row = top + pixel / block, column = left + pixel % block;
        if (row >= view.height || column >= view.width) continue;
        int group_count = 0, sky_count = 0;
        for (int sample = 0; sample < samples; ++sample) {
          const int i = pixel * samples + sample;
          if (!packet.hit(i)) {
            ++sky_count;
            continue;
          }
          const int car = packet.car(i);
          const std::uint32_t quad = packet.rays.hit.primID[i];
          const bool ground = car < 0 && world_->mesh.surfaces[quad].material == Material::kGround;
          int g = 0;
          while (g < group_count &&
                 !(groups[g].car == car && (groups[g].quad == quad || (ground && groups[g].ground))))
            ++g;
          if (g == group_count) groups[group_count++] = {car, quad, ground, 0, 0.0f, 0.0f, 0.0f};
          ++groups[g].count;
          groups[g].depth += packet.rays.ray.tfar[i];
          groups[g].u += packet.rays.hit.u[i];
          groups[g].v += packet.rays.hit.v[i];
        }
        const bool centred = group_count + (sky_count > 0 ? 1 : 0) == 1;
        float brightness = 0.0f;
        const Eigen::Vector3f direction =
            samples == 1 ? base.direction(column + offset_x, row + offset_y) : base.direction(column, row);
        if (sky_count > 0) brightness += static_cast<float>(sky_count) * shader_.sky(direction);
        for (int g = 0; g < group_count; ++g) {
          const Group& group = groups[g];
          const float mean = 1.0f / static_cast<float>(group.count);
          const bool moving = group.car >= 0;
          const Mesh& mesh =
              moving ? (*car_models_)[static_cast<std::size_t>(cars.cars()[group.car].model)] : world_->mesh;
          const Mesh::Quad& corners = mesh.quads[group.quad];
          const Eigen::Vector3f& corner = mesh.vertices[corners[0]];
          ShadingPoint point;
          point.direction = direction;
          point.direction_x = step_x;
          point.direction_y = step_y;
          point.depth = group.depth * mean;
          point.u = group.u * mean;
          point.v = group.v * mean;
          point.normal = mesh.normal(group.quad);
          if (!point.normal.allFinite()) point.normal = -direction.normalized();
          point.axis_s = (mesh.vertices[corners[1]] - corner).normalized();
          point.axis_t = (mesh.vertices[corners[3]] - corner).normalized();
          if (moving) {
            const Eigen::Matrix3f turn = cars.cars()[group.car].T_world_car.linear().cast<float>();
            point.normal = turn * point.normal;
            point.axis_s = turn * point.axis_s;
            point.axis_t = turn * point.axis_t;
          }
          if (group.ground) {
            // The ground's texture is laid by position: take the one in the plane of the first hit at the mean ray.
            Eigen::Vector3f ray = direction;
            if (!centred) {
              ray.setZero();
              for (int sample = 0; sample < samples; ++sample) {
                const int i = pixel * samples + sample;
                if (packet.hit(i) && packet.car(i) < 0 &&
                    world_->mesh.surfaces[packet.rays.hit.primID[i]].material == Material::kGround)
                  ray += mean * base.direction(column + pattern[sample].x, row + pattern[sample].y);
              }
            }
            const float distance = point.normal.dot(corner - base.origin) / point.normal.dot(ray);
            point.position = base.origin + (distance > 0.0f ? distance : point.depth) * ray;
          }
          brightness += static_cast<float>(group.count) * shader_.shade(mesh.surfaces[group.quad], point);
        }
        image(row, column) += share * brightness;
      }
    }
}

Hits ViewRenderer::trace(const View& view, const MovingScene& cars) const {
  const RayBase base(view);
  Hits hits{cv::Mat1f(view.height, view.width, std::numeric_limits<float>::quiet_NaN()),
            cv::Mat1i(view.height, view.width, -1)};
  RayPacket packet;
  for (int row = 0; row < view.height; ++row)
    for (int left = 0; left < view.width; left += RayPacket::kSize) {
      for (int i = 0; i < RayPacket::kSize; ++i) {
        if (left + i < view.width)
          packet.set(i, base.origin, base.direction(left + i, row));
        else
          packet.disable(i);
      }
      caster_->cast(packet);
      cars.cast(packet);
      for (int i = 0; i < RayPacket::kSize; ++i) {
        if (!packet.hit(i)) continue;
        hits.depth(row, left + i) = packet.rays.ray.tfar[i];
        hits.car(row, left + i) = packet.car(i);
      }
    }
  return hits;
}

}  // namespace sdvo::render
