#include "view_renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>

#include "sample_pattern.hpp"

namespace sdvo::render {

namespace {

/// Rays of a view; single precision only at the end.
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

/// Samples of one pixel that met the same surface: a quadrilateral, all of the ground, or the sky.
struct Group {
  static constexpr int kSky = -2, kStatic = -1;
  int car;  ///< or kSky, kStatic
  std::uint32_t quad;
  bool ground;
  int count;
  float depth, u, v, x, y;  ///< sums; x, y: position within the pixel

  bool sameSurface(const Group& other) const {
    return car == other.car && (quad == other.quad || (ground && other.ground) || car == kSky);
  }
};

/// What the samples of a pixel have met so far.
struct PixelHits {
  std::array<Group, kFineSamples> groups;
  int count = 0;

  void add(const Group& hit) {
    int i = 0;
    while (i < count && !groups[i].sameSurface(hit)) ++i;
    if (i == count) {
      groups[count++] = hit;
      return;
    }
    Group& group = groups[i];
    group.count += hit.count;
    group.depth += hit.depth;
    group.u += hit.u;
    group.v += hit.v;
    group.x += hit.x;
    group.y += hit.y;
  }
};

/// Orientation of a quadrilateral in the world; kept from pixel to pixel, since neighbours mostly show the same one.
struct Facet {
  int car = Group::kSky;
  std::uint32_t quad = 0;
  const Surface* surface = nullptr;
  Eigen::Vector3f corner, normal, axis_s, axis_t;
};

/// Casts the samples of one tile of pixels after the other.
class TileSampler {
 public:
  TileSampler(const RayBase& base, const World& world, const RayCaster& caster, const MovingScene& cars)
      : base_(base), world_(world), caster_(caster), cars_(cars) {}

  void begin(int left, int top) {
    left_ = left;
    top_ = top;
    for (PixelHits& pixel : pixels_) pixel.count = 0;
  }
  /// Asks for a ray; pixels are numbered row by row.
  void request(int pixel, const SampleOffset& offset) {
    requests_[count_++] = {pixel, offset};
    if (count_ == RayPacket::kSize) flush();
  }
  /// Casts what is still waiting.
  void flush() {
    if (count_ == 0) return;
    for (int ray = 0; ray < RayPacket::kSize; ++ray) {
      if (ray >= count_) {
        packet_.disable(ray);
        continue;
      }
      const Request& request = requests_[ray];
      packet_.set(ray, base_.origin,
                  base_.direction(left_ + request.pixel % kTileWidth + request.offset.x,
                                  top_ + request.pixel / kTileWidth + request.offset.y));
    }
    caster_.cast(packet_);
    cars_.cast(packet_);
    for (int ray = 0; ray < count_; ++ray) pixels_[requests_[ray].pixel].add(read(ray));
    count_ = 0;
  }

  const PixelHits& pixel(int i) const { return pixels_[i]; }

  /// Whether all samples so far met one surface.
  bool isUniform() const {
    const PixelHits& first = pixels_[0];
    return std::all_of(pixels_.begin(), pixels_.end(), [&](const PixelHits& pixel) {
      return pixel.count == 0 || (pixel.count == 1 && pixel.groups[0].sameSurface(first.groups[0]));
    });
  }
  /// Whether a pixel shows an edge that can be seen, or has a neighbour within the tile that does or that looks
  /// different, and is free of foliage.
  bool isNearSolidEdge(int i) const {
    const PixelHits& pixel = pixels_[i];
    for (int g = 0; g < pixel.count; ++g) {
      if (pixel.groups[g].car != Group::kStatic) continue;
      const Material material = world_.mesh.surfaces[pixel.groups[g].quad].material;
      if (material == Material::kLeaf || material == Material::kFoliage) return false;
    }
    if (pixel.count == 0) return false;
    const Group& reference = pixel.groups[0];
    const auto differs = [&](int j) {
      return std::any_of(pixels_[j].groups.begin(), pixels_[j].groups.begin() + pixels_[j].count,
                         [&](const Group& other) { return !lookAlike(reference, other); });
    };
    const int column = i % kTileWidth, other_row = i < kTileWidth ? i + kTileWidth : i - kTileWidth;
    return differs(i) || (column > 0 && differs(i - 1)) || (column + 1 < kTileWidth && differs(i + 1)) ||
           differs(other_row);
  }

 private:
  struct Request {
    int pixel;
    SampleOffset offset;
  };

  /// Whether two surfaces meet without an edge to be seen, as the sides of a post or the stones of a kerb do.
  bool lookAlike(const Group& a, const Group& b) const {
    if (a.sameSurface(b)) return true;
    if (a.car != Group::kStatic || b.car != Group::kStatic) return false;
    const Surface &one = world_.mesh.surfaces[a.quad], &other = world_.mesh.surfaces[b.quad];
    const float depth_a = a.depth / static_cast<float>(a.count), depth_b = b.depth / static_cast<float>(b.count);
    return one.material == other.material && std::abs(one.albedo - other.albedo) < 0.1f &&
           std::abs(depth_a - depth_b) < 0.02f * depth_a &&
           world_.mesh.normal(a.quad).dot(world_.mesh.normal(b.quad)) > 0.7f;
  }

  Group read(int ray) const {
    const SampleOffset& offset = requests_[ray].offset;
    Group hit{Group::kSky, 0, false, 1, 0.0f, 0.0f, 0.0f, offset.x, offset.y};
    if (!packet_.hit(ray)) return hit;
    hit.car = packet_.car(ray);
    hit.quad = packet_.rays.hit.primID[ray];
    hit.ground = hit.car == Group::kStatic && world_.mesh.surfaces[hit.quad].material == Material::kGround;
    hit.depth = packet_.rays.ray.tfar[ray];
    hit.u = packet_.rays.hit.u[ray];
    hit.v = packet_.rays.hit.v[ray];
    return hit;
  }

  const RayBase& base_;
  const World& world_;
  const RayCaster& caster_;
  const MovingScene& cars_;
  int left_ = 0, top_ = 0;
  RayPacket packet_;
  std::array<Request, RayPacket::kSize> requests_;
  int count_ = 0;
  std::array<PixelHits, RayPacket::kSize> pixels_;
};

}  // namespace

void ViewRenderer::add(const View& view, const MovingScene& cars, int samples, float offset_x, float offset_y,
                       float weight, cv::Mat1f& image) const {
  if (samples != 1 && samples != 4 && samples != kFineSamples)
    throw std::invalid_argument("samples per pixel must be 1, 4 or 16");
  const int tile_height = samples == 1 ? 4 : 2;
  const RayBase base(view);
  const Eigen::Vector3f step_x = base.step_x.cast<float>(), step_y = base.step_y.cast<float>();
  Facet facet;

  const auto orient = [&](const Group& group) {
    if (facet.car == group.car && facet.quad == group.quad) return;
    facet.car = group.car;
    facet.quad = group.quad;
    const bool moving = group.car >= 0;
    const Mesh& mesh = moving ? (*car_models_)[static_cast<std::size_t>(cars.cars()[group.car].model)] : world_->mesh;
    const Mesh::Quad& corners = mesh.quads[group.quad];
    facet.surface = &mesh.surfaces[group.quad];
    facet.corner = mesh.vertices[corners[0]];
    facet.normal = mesh.normal(group.quad);
    if (!facet.normal.allFinite()) facet.normal = Eigen::Vector3f(0.0f, -1.0f, 0.0f);
    facet.axis_s = (mesh.vertices[corners[1]] - facet.corner).normalized();
    facet.axis_t = (mesh.vertices[corners[3]] - facet.corner).normalized();
    if (moving) {
      const Eigen::Matrix3f turn = cars.cars()[group.car].T_world_car.linear().cast<float>();
      facet.normal = turn * facet.normal;
      facet.axis_s = turn * facet.axis_s;
      facet.axis_t = turn * facet.axis_t;
    }
  };
  const auto shade = [&](const Group& group, int column, int row) {
    const float mean = 1.0f / static_cast<float>(group.count);
    ShadingPoint point;
    point.direction = base.direction(column + group.x * mean, row + group.y * mean);
    if (group.car == Group::kSky) return shader_.sky(point.direction);
    if (group.car == Group::kStatic) {
      const Surface& surface = world_->mesh.surfaces[group.quad];
      if (surface.material == Material::kLeaf) return shader_.leaf(surface, group.u * mean, group.depth * mean);
    }
    orient(group);
    point.direction_x = step_x;
    point.direction_y = step_y;
    point.depth = group.depth * mean;
    point.u = group.u * mean;
    point.v = group.v * mean;
    point.normal = facet.normal;
    point.axis_s = facet.axis_s;
    point.axis_t = facet.axis_t;
    if (group.ground) {
      // The ground's texture is laid by position: that of the mean ray in the plane of the first hit.
      const float distance = facet.normal.dot(facet.corner - base.origin) / facet.normal.dot(point.direction);
      point.position = base.origin + (distance > 0.0f ? distance : point.depth) * point.direction;
    }
    return shader_.shade(*facet.surface, point);
  };

  TileSampler tile(base, *world_, *caster_, cars);
  for (int top = 0; top < view.height; top += tile_height)
    for (int left = 0; left < view.width; left += kTileWidth) {
      const auto forPixels = [&](const auto& visit) {
        for (int i = 0; i < tile_height * kTileWidth; ++i)
          if (top + i / kTileWidth < view.height && left + i % kTileWidth < view.width) visit(i);
      };
      const auto requestRegular = [&](int i, int first) {
        for (int sample = first; sample < first + 2; ++sample)
          tile.request(i, regularSample(i / kTileWidth, i % kTileWidth, sample));
      };
      tile.begin(left, top);
      forPixels([&](int i) {
        if (samples == 1) {
          tile.request(i, {offset_x, offset_y});
        } else if (samples == 4) {
          requestRegular(i, 0);
        } else {
          for (int sample = 0; sample < kFineSamples; ++sample) tile.request(i, fineSample(sample));
        }
      });
      tile.flush();
      // Where all of a tile's first samples meet one surface, more of them would tell nothing new. Elsewhere, an edge
      // that is followed over many frames deserves to be known better than foliage, of which every pixel is an edge.
      if (samples == 4 && !tile.isUniform()) {
        std::array<bool, RayPacket::kSize> edge{};
        forPixels([&](int i) { edge[i] = tile.isNearSolidEdge(i); });
        forPixels([&](int i) {
          requestRegular(i, 2);
          for (int sample = 0; edge[i] && sample < kEdgeSamples; ++sample) tile.request(i, edgeSample(sample));
        });
        tile.flush();
      }
      forPixels([&](int i) {
        const int row = top + i / kTileWidth, column = left + i % kTileWidth;
        const PixelHits& pixel = tile.pixel(i);
        float brightness = 0.0f;
        int count = 0;
        for (int g = 0; g < pixel.count; ++g) {
          brightness += static_cast<float>(pixel.groups[g].count) * shade(pixel.groups[g], column, row);
          count += pixel.groups[g].count;
        }
        image(row, column) += weight * brightness / static_cast<float>(count);
      });
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
