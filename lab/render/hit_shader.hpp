#pragma once

#include <cstdint>
#include <vector>

#include "facet.hpp"
#include "pixel_hits.hpp"
#include "shader.hpp"
#include "vehicles.hpp"
#include "view.hpp"

namespace sdvo::render {

/// Shades what the rays of one view have hit.
class HitShader {
 public:
  /// `materials` of the world's quadrilaterals; all but `base` and `cars` must outlive this.
  HitShader(const RayBase& base, const World& world, const std::vector<Material>& materials,
            const std::vector<Mesh>& car_models, const std::vector<Traffic::Car>& cars, const Shader& shader);

  /// Brightness where a ray with this direction meets the surface of the hit, wherever on it the hit itself lies.
  float shade(const Hit& hit, const Eigen::Vector3f& direction);
  /// Brightness of samples on one surface, shaded together at their mean, which lies in this direction.
  float shade(const HitGroup& group, const Eigen::Vector3f& direction);

 private:
  struct Car {
    const Mesh* mesh;
    Eigen::Isometry3f T_world_car;
  };

  float shadeFacet(const Eigen::Vector3f& direction, const Facet::Place& place) const;
  void turnTo(const Hit& hit, const Facet::Place& place);

  const Eigen::Vector3f origin_, step_x_, step_y_;  // of the rays, per px
  const Mesh* mesh_;
  const std::vector<Material>* materials_;
  const Shader* shader_;
  std::vector<Car> cars_;

  Facet facet_;  // the one shaded last
  int facet_car_ = Hit::kSky;
  std::uint32_t facet_quad_ = 0;
  bool facet_second_ = false;
};

// Inline, because every pixel comes here.

inline float HitShader::shade(const Hit& hit, const Eigen::Vector3f& direction) {
  if (hit.car == Hit::kSky) return shader_->sky(direction);
  const Facet::Place place = {hit.depth, hit.u, hit.v};
  turnTo(hit, place);
  return shadeFacet(direction, facet_.meet(direction, place));
}

inline float HitShader::shade(const HitGroup& group, const Eigen::Vector3f& direction) {
  const float mean = 1.0f / static_cast<float>(group.count);
  const Facet::Place place = {group.depth * mean, group.u * mean, group.v * mean};
  const Hit& hit = group.first;
  if (hit.car == Hit::kStatic && (*materials_)[hit.quad] == Material::kLeaf)
    return shader_->leaf(mesh_->surfaces[hit.quad], place.u, place.depth);
  if (hit.car == Hit::kSky) return shader_->sky(direction);
  turnTo(hit, {hit.depth, hit.u, hit.v});
  // The ground's cells count as one surface: what their mean means is known in the plane of the first.
  return shadeFacet(direction, hit.key == Hit::kGroundKey ? facet_.meet(direction, place) : place);
}

inline float HitShader::shadeFacet(const Eigen::Vector3f& direction, const Facet::Place& place) const {
  const Surface& surface = facet_.surface();
  if (surface.material == Material::kLeaf) return shader_->leaf(surface, place.u, place.depth);
  return shader_->shade(surface, {origin_ + place.depth * direction, direction, step_x_, step_y_, facet_.normal(),
                                  facet_.axisS(), facet_.axisT(), place.depth, place.u, place.v});
}

/// Neighbours mostly show the same quadrilateral: it is kept from pixel to pixel.
inline void HitShader::turnTo(const Hit& hit, const Facet::Place& place) {
  const bool second = place.u + place.v > 1.0f;
  if (facet_car_ == hit.car && facet_quad_ == hit.quad && facet_second_ == second) return;
  facet_car_ = hit.car;
  facet_quad_ = hit.quad;
  facet_second_ = second;
  const Car* car = hit.car >= 0 ? &cars_[static_cast<std::size_t>(hit.car)] : nullptr;
  facet_.set(car != nullptr ? *car->mesh : *mesh_, hit.quad, car != nullptr ? &car->T_world_car : nullptr, origin_,
             second);
}

}  // namespace sdvo::render
