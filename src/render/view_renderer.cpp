#include "view_renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <stdexcept>

#include "facet.hpp"
#include "pixel_hits.hpp"

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

/// Renders one view: a first sample of every pixel, then as many more as the neighbours of a pixel make necessary.
class ViewPass {
 public:
  ViewPass(const View& view, const World& world, const std::vector<Material>& materials, const RayCaster& caster,
           const std::vector<Mesh>& car_models, const MovingScene& cars, const Shader& shader, int samples,
           SampleOffset offset)
      : base_(view),
        step_x_(base_.step_x.cast<float>()),
        step_y_(base_.step_y.cast<float>()),
        width_(view.width),
        height_(view.height),
        world_(world),
        materials_(materials),
        caster_(caster),
        car_models_(car_models),
        cars_(cars),
        shader_(shader),
        samples_(samples),
        offset_(offset),
        first_(static_cast<std::size_t>(kKeptRows) * view.width),
        keys_(static_cast<std::size_t>(kKeptRows) * (view.width + 2)),
        differs_(static_cast<std::size_t>(kBandHeight) * view.width) {
    for (const Traffic::Car& car : cars.cars()) {
      T_world_cars_.push_back(car.T_world_car.cast<float>());
      car_boxes_.push_back(boxOf(car_models[static_cast<std::size_t>(car.model)], car.T_world_car, view));
    }
    packet_.start(base_.origin);
  }

  void run(float weight, cv::Mat1f& image) {
    const bool has_first = samples_ != kFineSamples;
    if (has_first) castBand(0);
    for (int top = 0; top < height_; top += kBandHeight) {
      if (has_first && top + kBandHeight < height_) castBand(top + kBandHeight);
      if (samples_ == kRegularSamples) compareNeighbours(top);
      for (int left = 0; left < width_; left += kTileWidth) finishTile(left, top, weight, image);
    }
  }

 private:
  static constexpr int kBandHeight = 4, kTileWidth = 8;
  static constexpr int kKeptRows = 3 * kBandHeight;  // the rows at hand with those above and below
  static constexpr int kPacketWidth = RayPacket::kSize / kBandHeight;

  struct Request {
    int pixel;  ///< of the tile
    SampleOffset offset;
  };

  Hit* firstRow(int row) { return &first_[static_cast<std::size_t>(row % kKeptRows) * width_]; }
  /// Keys of the hits of a row; those of the first and the last column are there twice.
  std::uint32_t* keyRow(int row) { return &keys_[static_cast<std::size_t>(row % kKeptRows) * (width_ + 2) + 1]; }
  SampleOffset firstOffset(int row, int column) const {
    return samples_ == 1 ? offset_ : regularSample(row, column, 0);
  }

  Hit read(int ray) const {
    if (!packet_.hit(ray)) return {};
    Hit hit;
    hit.car = packet_.car(ray) < 0 ? Hit::kStatic : packet_.car(ray);
    hit.quad = packet_.rays.hit.primID[ray];
    if (hit.car >= 0)
      hit.key = 0x80000000u | static_cast<std::uint32_t>(hit.car) << 16 | hit.quad;
    else
      hit.key = materials_[hit.quad] == Material::kGround ? Hit::kGroundKey : hit.quad;
    hit.depth = packet_.rays.ray.tfar[ray];
    hit.u = packet_.rays.hit.u[ray];
    hit.v = packet_.rays.hit.v[ray];
    return hit;
  }

  /// The part of the image that a car can lie in, with a pixel to spare.
  static cv::Rect boxOf(const Mesh& model, const Eigen::Isometry3d& T_world_car, const View& view) {
    const Eigen::Isometry3d T_camera_car = view.T_world_camera.inverse() * T_world_car;
    const cv::Rect image(0, 0, view.width, view.height);
    Eigen::Array2d low(1e6, 1e6), high(-1e6, -1e6);
    for (const Eigen::Vector3f& vertex : model.vertices) {
      const Eigen::Vector3d point = T_camera_car * vertex.cast<double>();
      if (point.z() < 0.1) return image;  // beside the camera: anywhere
      const Eigen::Array2d place(view.fx * point.x() / point.z() + view.cx, view.fy * point.y() / point.z() + view.cy);
      low = low.min(place);
      high = high.max(place);
    }
    low = low.max(-10.0).min(1e5);
    high = high.max(-10.0).min(1e5);
    return image & cv::Rect(cv::Point(static_cast<int>(low.x()) - 2, static_cast<int>(low.y()) - 2),
                            cv::Point(static_cast<int>(high.x()) + 3, static_cast<int>(high.y()) + 3));
  }

  /// Casts the rays through some part of the image.
  void castPacket(const cv::Rect& part) {
    caster_.cast(packet_);
    for (const cv::Rect& box : car_boxes_)
      if ((box & part).area() > 0) {
        cars_.cast(packet_);
        return;
      }
  }

  /// Casts the first samples of some rows.
  void castBand(int top) {
    const int bottom = std::min(top + kBandHeight, height_);
    for (int left = 0; left < width_; left += kPacketWidth) {
      const Eigen::Vector3f corner = base_.direction(left, top);
      for (int i = 0; i < RayPacket::kSize; ++i) {
        const int row = i / kPacketWidth, column = i % kPacketWidth;
        if (top + row >= bottom || left + column >= width_) {
          packet_.disable(i);
          continue;
        }
        const SampleOffset offset = firstOffset(top + row, left + column);
        packet_.set(i, corner + (static_cast<float>(column) + offset.x) * step_x_ +
                           (static_cast<float>(row) + offset.y) * step_y_);
      }
      castPacket({left, top, kPacketWidth, kBandHeight});
      for (int row = top; row < bottom; ++row) {
        Hit* hits = firstRow(row);
        for (int column = left; column < std::min(left + kPacketWidth, width_); ++column)
          hits[column] = read((row - top) * kPacketWidth + column - left);
      }
    }
    for (int row = top; row < bottom; ++row) {
      const Hit* hits = firstRow(row);
      std::uint32_t* keys = keyRow(row);
      for (int column = 0; column < width_; ++column) keys[column] = hits[column].key;
      keys[-1] = keys[0];
      keys[width_] = keys[width_ - 1];
    }
  }

  Eigen::Vector3f directionTo(int pixel, const SampleOffset& offset) const {
    return tile_corner_ + (static_cast<float>(pixel % kTileWidth) + offset.x) * step_x_ +
           (static_cast<float>(pixel / kTileWidth) + offset.y) * step_y_;
  }
  void request(int pixel, const SampleOffset& offset) {
    requests_[request_count_++] = {pixel, offset};
    if (request_count_ == RayPacket::kSize) castRequests();
  }
  void castRequests() {
    if (request_count_ == 0) return;
    for (int ray = 0; ray < RayPacket::kSize; ++ray) {
      if (ray >= request_count_) {
        packet_.disable(ray);
        continue;
      }
      const auto& [pixel, offset] = requests_[ray];
      packet_.set(ray, directionTo(pixel, offset));
    }
    castPacket(tile_);
    for (int ray = 0; ray < request_count_; ++ray) pixels_[requests_[ray].pixel].add(read(ray), requests_[ray].offset);
    request_count_ = 0;
  }

  /// Whether two surfaces meet without an edge to be seen, as the sides of a post or the stones of a kerb do.
  bool lookAlike(const Hit& a, const Hit& b) const {
    if (a.isSame(b)) return true;
    if (a.car != Hit::kStatic || b.car != Hit::kStatic) return false;
    if (materials_[a.quad] != materials_[b.quad] || std::abs(a.depth - b.depth) > 0.02f * a.depth) return false;
    const Surface &one = world_.mesh.surfaces[a.quad], &other = world_.mesh.surfaces[b.quad];
    return std::abs(one.albedo - other.albedo) < 0.1f &&
           world_.mesh.normal(a.quad).dot(world_.mesh.normal(b.quad)) > 0.7f;
  }
  bool isFoliage(const Hit& hit) const {
    if (hit.car != Hit::kStatic) return false;
    return materials_[hit.quad] == Material::kLeaf || materials_[hit.quad] == Material::kFoliage;
  }

  /// Finds the pixels of some rows that have any neighbour that meets another surface.
  void compareNeighbours(int top) {
    for (int row = top; row < std::min(top + kBandHeight, height_); ++row) {
      const std::uint32_t* above = keyRow(std::max(row - 1, 0));
      const std::uint32_t* here = keyRow(row);
      const std::uint32_t* below = keyRow(std::min(row + 1, height_ - 1));
      std::uint32_t* differs = &differs_[static_cast<std::size_t>(row - top) * width_];
      for (int column = 0; column < width_; ++column) {
        const std::uint32_t key = here[column];
        differs[column] = (above[column - 1] ^ key) | (above[column] ^ key) | (above[column + 1] ^ key) |
                          (here[column - 1] ^ key) | (here[column + 1] ^ key) | (below[column - 1] ^ key) |
                          (below[column] ^ key) | (below[column + 1] ^ key);
      }
    }
  }

  /// How many samples a pixel whose neighbours differ needs beyond its first: an edge that is followed over many frames
  /// deserves to be known better than foliage, of which every pixel is an edge.
  int furtherSamples(int row, int column) {
    constexpr int kFew = kRegularSamples - 1;
    const Hit* row_hits = firstRow(row);
    const Hit& here = row_hits[column];
    if (isFoliage(here)) return kFew;
    const Hit* const neighbours[] = {&row_hits[std::max(column - 1, 0)], &row_hits[std::min(column + 1, width_ - 1)],
                                     &firstRow(std::max(row - 1, 0))[column],
                                     &firstRow(std::min(row + 1, height_ - 1))[column]};
    for (const Hit* neighbour : neighbours)
      if (!isFoliage(*neighbour) && !lookAlike(here, *neighbour)) return kFew + kEdgeSamples;
    return kFew;
  }

  void finishTile(int left, int top, float weight, cv::Mat1f& image) {
    tile_ = {left, top, kTileWidth, kBandHeight};
    tile_corner_ = base_.direction(left, top);
    const int columns = std::min(kTileWidth, width_ - left), rows = std::min(kBandHeight, height_ - top);
    std::array<bool, kTileWidth * kBandHeight> single{};
    for (int y = 0; y < rows; ++y)
      for (int x = 0; x < columns; ++x) {
        const int pixel = y * kTileWidth + x;
        pixels_[pixel].clear();
        if (samples_ == kFineSamples) {
          for (int sample = 0; sample < kFineSamples; ++sample) request(pixel, fineSample(sample));
          continue;
        }
        single[pixel] = samples_ == 1 || differs_[static_cast<std::size_t>(y) * width_ + left + x] == 0;
        if (single[pixel]) continue;
        const int further = furtherSamples(top + y, left + x);
        pixels_[pixel].add(firstRow(top + y)[left + x], firstOffset(top + y, left + x));
        for (int sample = 1; sample < kRegularSamples; ++sample)
          request(pixel, regularSample(top + y, left + x, sample));
        for (int sample = 0; sample < further - kRegularSamples + 1; ++sample) request(pixel, edgeSample(sample));
      }
    castRequests();
    for (int y = 0; y < rows; ++y)
      for (int x = 0; x < columns; ++x) {
        const int pixel = y * kTileWidth + x;
        float brightness = 0.0f;
        if (single[pixel] || (samples_ == kRegularSamples && pixels_[pixel].isOne())) {
          brightness = shadeSingle(firstRow(top + y)[left + x], pixel);
        } else {
          int count = 0;
          for (const HitGroup& group : pixels_[pixel]) {
            brightness += static_cast<float>(group.count) * shadeGroup(group, pixel);
            count += group.count;
          }
          brightness /= static_cast<float>(count);
        }
        image(top + y, left + x) += weight * brightness;
      }
  }

  /// A pixel that shows one surface is shaded at its centre, wherever its sample lies; the only sample that is asked
  /// for, in its place.
  float shadeSingle(const Hit& hit, int pixel) {
    const SampleOffset offset = samples_ == 1 ? offset_ : SampleOffset{0.0f, 0.0f};
    const Eigen::Vector3f direction = directionTo(pixel, offset);
    if (hit.car == Hit::kSky) return shader_.sky(direction);
    const Facet::Place place = {hit.depth, hit.u, hit.v};
    turnTo(hit, place);
    return shadeFacet(direction, facet_.meet(direction, place));
  }
  /// Samples on one surface are shaded together, at their mean.
  float shadeGroup(const HitGroup& group, int pixel) {
    const float mean = 1.0f / static_cast<float>(group.count);
    const Facet::Place place = {group.depth * mean, group.u * mean, group.v * mean};
    const Hit& hit = group.first;
    if (hit.car == Hit::kStatic && materials_[hit.quad] == Material::kLeaf)
      return shader_.leaf(world_.mesh.surfaces[hit.quad], place.u, place.depth);
    const Eigen::Vector3f direction = directionTo(pixel, {group.x * mean, group.y * mean});
    if (hit.car == Hit::kSky) return shader_.sky(direction);
    turnTo(hit, {hit.depth, hit.u, hit.v});
    // The ground's cells count as one surface: what their mean means is known in the plane of the first.
    return shadeFacet(direction, hit.key == Hit::kGroundKey ? facet_.meet(direction, place) : place);
  }
  float shadeFacet(const Eigen::Vector3f& direction, const Facet::Place& place) const {
    const Surface& surface = facet_.surface();
    if (surface.material == Material::kLeaf) return shader_.leaf(surface, place.u, place.depth);
    return shader_.shade(surface, {base_.origin + place.depth * direction, direction, step_x_, step_y_, facet_.normal(),
                                   facet_.axisS(), facet_.axisT(), place.depth, place.u, place.v});
  }
  /// Neighbours mostly show the same quadrilateral: it is kept from pixel to pixel.
  void turnTo(const Hit& hit, const Facet::Place& place) {
    const bool second = place.u + place.v > 1.0f;
    if (facet_car_ == hit.car && facet_quad_ == hit.quad && facet_second_ == second) return;
    facet_car_ = hit.car;
    facet_quad_ = hit.quad;
    facet_second_ = second;
    const bool moving = hit.car >= 0;
    const Mesh& mesh =
        moving ? car_models_[static_cast<std::size_t>(cars_.cars()[static_cast<std::size_t>(hit.car)].model)]
               : world_.mesh;
    facet_.set(mesh, hit.quad, moving ? &T_world_cars_[static_cast<std::size_t>(hit.car)] : nullptr, base_.origin,
               second);
  }

  const RayBase base_;
  const Eigen::Vector3f step_x_, step_y_;
  const int width_, height_;
  const World& world_;
  const std::vector<Material>& materials_;
  const RayCaster& caster_;
  const std::vector<Mesh>& car_models_;
  const MovingScene& cars_;
  const Shader& shader_;
  const int samples_;
  const SampleOffset offset_;
  std::vector<Eigen::Isometry3f> T_world_cars_;
  std::vector<cv::Rect> car_boxes_;

  std::vector<Hit> first_;              // of the kept rows
  std::vector<std::uint32_t> keys_;     // theirs
  std::vector<std::uint32_t> differs_;  // of the rows at hand: not 0 where a neighbour meets another surface
  RayPacket packet_;
  cv::Rect tile_;
  Eigen::Vector3f tile_corner_;  // direction of the ray through the centre of its first pixel
  std::array<PixelHits, kTileWidth * kBandHeight> pixels_;
  std::array<Request, RayPacket::kSize> requests_;
  int request_count_ = 0;

  Facet facet_;
  int facet_car_ = Hit::kSky;
  std::uint32_t facet_quad_ = 0;
  bool facet_second_ = false;
};

}  // namespace

ViewRenderer::ViewRenderer(const World& world, const RayCaster& caster, const std::vector<Mesh>& car_models)
    : world_(&world), caster_(&caster), car_models_(&car_models), shader_(world) {
  materials_.reserve(world.mesh.surfaces.size());
  for (const Surface& surface : world.mesh.surfaces) materials_.push_back(surface.material);
}

void ViewRenderer::add(const View& view, const MovingScene& cars, int samples, float offset_x, float offset_y,
                       float weight, cv::Mat1f& image) const {
  if (samples != 1 && samples != kRegularSamples && samples != kFineSamples)
    throw std::invalid_argument("samples per pixel must be 1, 4 or 16");
  ViewPass(view, *world_, materials_, *caster_, *car_models_, cars, shader_, samples, {offset_x, offset_y})
      .run(weight, image);
}

Hits ViewRenderer::trace(const View& view, const MovingScene& cars) const {
  const RayBase base(view);
  Hits hits{cv::Mat1f(view.height, view.width, std::numeric_limits<float>::quiet_NaN()),
            cv::Mat1i(view.height, view.width, -1)};
  RayPacket packet;
  packet.start(base.origin);
  for (int row = 0; row < view.height; ++row)
    for (int left = 0; left < view.width; left += RayPacket::kSize) {
      for (int i = 0; i < RayPacket::kSize; ++i) {
        if (left + i < view.width)
          packet.set(i, base.direction(left + i, row));
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
