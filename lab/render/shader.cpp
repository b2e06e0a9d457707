#include "shader.hpp"

#include <algorithm>
#include <cmath>

namespace sdvo::render {

namespace {

// Below this cosine a surface is seen edge-on and the footprint would run to infinity.
constexpr float kMinCosine = 0.004f;

/// Share of a window of `width` around x that lies in [from, to].
float coverage(float x, float width, float from, float to) {
  return std::clamp((std::min(x + 0.5f * width, to) - std::max(x - 0.5f * width, from)) / width, 0.0f, 1.0f);
}

/// Share of a window around x that a periodic mark of `length` every `period` covers.
float dashes(float x, float width, float length, float period) {
  if (width > period) return length / period;
  const float phase = x - period * std::floor(x / period);
  return coverage(phase, width, 0.0f, length) + coverage(phase - period, width, 0.0f, length) +
         coverage(phase + period, width, 0.0f, length);
}

}  // namespace

float Shader::sky(const Eigen::Vector3f& direction) const {
  const float elevation = -direction.y() / direction.norm();
  return world_->sky * (1.0f - 0.35f * std::clamp(elevation, 0.0f, 1.0f));
}

float Shader::throughHaze(float brightness, float depth) const {
  if (world_->haze_distance <= 0.0) return brightness;
  const float clear = std::exp(-depth / static_cast<float>(world_->haze_distance));
  return world_->sky + (brightness - world_->sky) * clear;
}

float Shader::leaf(const Surface& surface, float u, float depth) const {
  const float reflectance = surface.albedo * (0.6f + 0.8f * std::abs(u - 0.3f));  // lighter towards the tip
  return throughHaze(reflectance * surface.sun_front, depth);
}

float Shader::ground(const ShadingPoint& point, const Eigen::Vector3f& step_x, const Eigen::Vector3f& step_y) const {
  const float x = point.position.x(), z = point.position.z();
  const Footprint footprint = {step_x.x(), step_x.z(), step_y.x(), step_y.z()};
  const GroundMap::Place place = world_->ground->at(x, z);
  const Eigen::Vector2f across =
      place.road_gradient.squaredNorm() > 0.25f ? place.road_gradient.normalized() : Eigen::Vector2f(1.0f, 0.0f);
  const Eigen::Vector2f along(-across.y(), across.x());
  const auto extent = [&](const Eigen::Vector2f& axis) {
    return std::max(0.004f, std::abs(axis.x() * footprint.s_x + axis.y() * footprint.t_x) +
                                std::abs(axis.x() * footprint.s_y + axis.y() * footprint.t_y));
  };
  const float width = extent(across), length = extent(along);
  const TextureSet& textures = *world_->textures;
  const auto texture = [&](Material material) { return textures.of(material)->sample(x, z, footprint); };

  constexpr auto kEdge = static_cast<float>(GroundMap::kRoadHalfWidth);
  const float on_road = coverage(place.road, width, -1e3f, kEdge);
  float reflectance = 0.0f;
  if (on_road > 0.0f) {
    float road = 0.50f * texture(Material::kAsphalt);
    if (!place.mixed && std::sin(place.along * 0.013f) > -0.2f) {
      const float line = coverage(place.lateral, width, -1.71f, -1.59f) * dashes(place.along, length, 3.0f, 9.0f);
      const float edge = coverage(place.road, width, 3.85f, 3.97f);
      road += (0.75f - road) * 0.8f * std::max(line, edge);
    }
    reflectance += on_road * road;
  }
  if (on_road < 1.0f) {
    // Walkways on stretches of either side, grass elsewhere.
    const bool paved_right = place.lateral > 0.0f && std::sin(place.along * 0.031f + 1.0f) > -0.5f;
    const bool paved_left = place.lateral < 0.0f && std::sin(place.along * 0.023f) > 0.5f;
    const float paved_to = paved_right ? 7.2f : paved_left ? 6.4f : kEdge;
    const float paved = coverage(place.road, width, kEdge, paved_to) / std::max(1.0f - on_road, 1e-3f);
    float beside = 0.0f;
    if (paved > 0.0f) beside += std::min(paved, 1.0f) * 0.85f * texture(Material::kPaving);
    if (paved < 1.0f) beside += (1.0f - std::min(paved, 1.0f)) * 0.62f * texture(Material::kGrass);
    reflectance += (1.0f - on_road) * beside;
  }
  // Stains and worn places of several metres.
  constexpr float kScale = 0.17f;
  reflectance *= 0.72f + 0.56f * textures.detail().sample(x * kScale, z * kScale, kScale * std::max(width, length));

  const float sun_share = world_->sunlight ? world_->sunlight->sample(x, z, std::max(width, 0.5f * length)) : 1.0f;
  return reflectance * world_->irradiance(Eigen::Vector3f(0.0f, -1.0f, 0.0f), sun_share);
}

float Shader::shade(const Surface& surface, const ShadingPoint& point) const {
  // What the ray does on the surface when the pixel moves by one: it stays in the plane.
  float facing = point.normal.dot(point.direction);
  const bool front = facing < 0.0f;
  const float limit = kMinCosine * point.direction.norm();
  if (std::abs(facing) < limit) facing = front ? -limit : limit;
  const Eigen::Vector3f slide = point.direction * (point.depth / facing);
  const auto step = [&](const Eigen::Vector3f& change) -> Eigen::Vector3f {
    return point.depth * change - slide * point.normal.dot(change);
  };

  float brightness = 0.0f;
  if (surface.material == Material::kGround) {
    brightness = ground(point, step(point.direction_x), step(point.direction_y));
  } else {
    float reflectance = surface.albedo;
    if (const Texture* texture = world_->textures->of(surface.material)) {
      const Eigen::Vector3f step_x = step(point.direction_x), step_y = step(point.direction_y);
      const Footprint footprint = {step_x.dot(point.axis_s), step_x.dot(point.axis_t), step_y.dot(point.axis_s),
                                   step_y.dot(point.axis_t)};
      const float s = surface.s0 + point.u * surface.length_s, t = surface.t0 + point.v * surface.length_t;
      reflectance *= texture->sample(s, t, footprint);
      // Detail of another period hides that walls repeat, without hiding that their windows do.
      if (surface.material >= Material::kFacade) {
        const float width = 0.5f * (std::abs(footprint.s_x) + std::abs(footprint.t_x) + std::abs(footprint.s_y) +
                                    std::abs(footprint.t_y));
        reflectance *= 0.9f + 0.2f * world_->textures->detail().sample(s + 0.37f * surface.length_s, t, width);
      }
    }
    const Eigen::Vector3f normal = front ? point.normal : Eigen::Vector3f(-point.normal);
    brightness = reflectance * world_->irradiance(normal, front ? surface.sun_front : surface.sun_back);
  }
  return throughHaze(brightness, point.depth);
}

}  // namespace sdvo::render
