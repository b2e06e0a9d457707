#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "ray_caster.hpp"
#include "shader.hpp"
#include "vehicles.hpp"
#include "view.hpp"
#include "world.hpp"

namespace sdvo::render {

/// What is known of the centres of a view's pixels.
struct Hits {
  cv::Mat1f depth;  ///< along the optical axis, m; NaN in the sky
  cv::Mat1i car;    ///< index into the moving scene's cars, or −1
};

/// Casts the rays of a view and shades what they hit.
class ViewRenderer {
 public:
  /// All of these must outlive the renderer.
  ViewRenderer(const World& world, const RayCaster& caster, const std::vector<Mesh>& car_models);

  /// Adds `weight` times the brightness (1 = white) of the view to `image`. With 1 sample per pixel it lies at
  /// (offset_x, offset_y) px from the pixel's centre; with 4 there are as many at foliage, 12 at other edges and
  /// 1 where nothing changes; 16 are always cast. Samples of a pixel on one surface are shaded together: edges are
  /// anti-aliased by the samples, textures by their filter.
  void add(const View& view, const MovingScene& cars, int samples, float offset_x, float offset_y, float weight,
           cv::Mat1f& image) const;

  Hits trace(const View& view, const MovingScene& cars) const;

 private:
  const World* world_;
  const RayCaster* caster_;
  const std::vector<Mesh>* car_models_;
  Shader shader_;
  std::vector<Material> materials_;  // of all quadrilaterals, packed: this is read for every ray
};

}  // namespace sdvo::render
