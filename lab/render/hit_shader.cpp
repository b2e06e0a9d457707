#include "hit_shader.hpp"

namespace sdvo::render {

HitShader::HitShader(const RayBase& base, const World& world, const std::vector<Material>& materials,
                     const std::vector<Mesh>& car_models, const std::vector<Traffic::Car>& cars, const Shader& shader)
    : origin_(base.origin),
      step_x_(base.step_x.cast<float>()),
      step_y_(base.step_y.cast<float>()),
      mesh_(&world.mesh),
      materials_(&materials),
      shader_(&shader) {
  for (const Traffic::Car& car : cars)
    cars_.push_back({&car_models[static_cast<std::size_t>(car.model)], car.T_world_car.cast<float>()});
}

}  // namespace sdvo::render
