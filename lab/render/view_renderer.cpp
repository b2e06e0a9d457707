#include "view_renderer.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <stdexcept>

#include "first_hits.hpp"
#include "hit_shader.hpp"
#include "pixel_hits.hpp"

namespace sdvo::render {

namespace {

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
        materials_(materials),
        caster_(caster),
        cars_(cars),
        samples_(samples),
        offset_(offset),
        first_(view.width, view.height, world, materials),
        shader_(base_, world, materials, car_models, cars.cars(), shader) {
    for (const Traffic::Car& car : cars.cars())
      car_boxes_.push_back(boxOf(car_models[static_cast<std::size_t>(car.model)], car.T_world_car, view));
    packet_.start(base_.origin);
  }

  void run(float weight, cv::Mat1f& image) {
    const bool has_first = samples_ != kFineSamples;
    if (has_first) castBand(0);
    for (int top = 0; top < height_; top += kBandHeight) {
      if (has_first && top + kBandHeight < height_) castBand(top + kBandHeight);
      if (samples_ == kRegularSamples) first_.compareNeighbours(top);
      for (int left = 0; left < width_; left += kTileWidth) finishTile(left, top, weight, image);
    }
  }

 private:
  static constexpr int kBandHeight = FirstHits::kBandHeight, kTileWidth = 8;
  static constexpr int kPacketWidth = RayPacket::kSize / kBandHeight;

  struct Request {
    int pixel;  ///< of the tile
    SampleOffset offset;
  };

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
        Hit* hits = first_.row(row);
        for (int column = left; column < std::min(left + kPacketWidth, width_); ++column)
          hits[column] = read((row - top) * kPacketWidth + column - left);
      }
    }
    first_.closeBand(top);
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
        single[pixel] = samples_ == 1 || !first_.differs(top + y, left + x);
        if (single[pixel]) continue;
        const int further = first_.furtherSamples(top + y, left + x);
        pixels_[pixel].add(first_.row(top + y)[left + x], firstOffset(top + y, left + x));
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
          // One surface is shaded at the pixel's centre, wherever the sample lies; the only sample that is asked for,
          // in its place.
          const SampleOffset offset = samples_ == 1 ? offset_ : SampleOffset{0.0f, 0.0f};
          brightness = shader_.shade(first_.row(top + y)[left + x], directionTo(pixel, offset));
        } else {
          int count = 0;
          for (const HitGroup& group : pixels_[pixel]) {
            brightness +=
                static_cast<float>(group.count) * shader_.shade(group, directionTo(pixel, group.meanOffset()));
            count += group.count;
          }
          brightness /= static_cast<float>(count);
        }
        image(top + y, left + x) += weight * brightness;
      }
  }

  const RayBase base_;
  const Eigen::Vector3f step_x_, step_y_;
  const int width_, height_;
  const std::vector<Material>& materials_;
  const RayCaster& caster_;
  const MovingScene& cars_;
  const int samples_;
  const SampleOffset offset_;
  std::vector<cv::Rect> car_boxes_;

  FirstHits first_;
  HitShader shader_;
  RayPacket packet_;
  cv::Rect tile_;
  Eigen::Vector3f tile_corner_;  // direction of the ray through the centre of its first pixel
  std::array<PixelHits, kTileWidth * kBandHeight> pixels_;
  std::array<Request, RayPacket::kSize> requests_;
  int request_count_ = 0;
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
