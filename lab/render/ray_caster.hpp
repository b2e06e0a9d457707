#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <memory>
#include <vector>

#include "embree.hpp"
#include "mesh.hpp"
#include "vehicles.hpp"

namespace sdvo::render {

/// Sixteen rays that are cast together; what they hit first stands in it afterwards.
struct alignas(64) RayPacket {
  static constexpr int kSize = 16;

  RTCRayHit16 rays;
  alignas(64) int valid[kSize];

  /// All rays to come start here; must come before any other call.
  void start(const Eigen::Vector3f& origin);
  void set(int i, const Eigen::Vector3f& direction) {
    valid[i] = -1;
    rays.ray.dir_x[i] = direction.x();
    rays.ray.dir_y[i] = direction.y();
    rays.ray.dir_z[i] = direction.z();
    rays.ray.tfar[i] = std::numeric_limits<float>::infinity();
    rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  void disable(int i) { valid[i] = 0; }
  bool hit(int i) const { return valid[i] != 0 && rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID; }
  /// Index into MovingScene's cars, or −1 when what was hit stands still.
  int car(int i) const {
    return rays.hit.instID[0][i] == RTC_INVALID_GEOMETRY_ID ? -1 : static_cast<int>(rays.hit.instID[0][i]);
  }
};

/// Embree's device, shared by all scenes.
class Device {
 public:
  /// Throws std::runtime_error when Embree cannot start.
  explicit Device(int threads);
  RTCDevice get() const { return device_.get(); }

 private:
  std::shared_ptr<RTCDeviceTy> device_;
};

/// First hits of rays with one mesh that stands still. Casting is safe from many threads at once.
class RayCaster {
 public:
  RayCaster(const Device& device, const Mesh& mesh);

  void cast(RayPacket& packet) const;
  /// Whether anything lies between the point and far away in that direction.
  bool occluded(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const;
  RTCScene scene() const { return scene_.get(); }

 private:
  std::shared_ptr<RTCSceneTy> scene_;
};

/// The cars at one moment; every thread has its own.
class MovingScene {
 public:
  MovingScene(const Device& device, const std::vector<RayCaster>& models);

  void place(const std::vector<Traffic::Car>& cars);
  const std::vector<Traffic::Car>& cars() const { return cars_; }
  /// Continues rays that RayCaster has cast: a car in front replaces the hit.
  void cast(RayPacket& packet) const;

 private:
  RTCDevice device_;
  const std::vector<RayCaster>* models_;
  std::vector<Traffic::Car> cars_;
  std::shared_ptr<RTCSceneTy> scene_;
};

}  // namespace sdvo::render
