#include "ray_caster.hpp"

#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>

namespace sdvo::render {

namespace {

// Rays start a little ahead of the camera: nothing nearer can be seen in focus.
constexpr float kNear = 0.05f;

std::shared_ptr<RTCSceneTy> newScene(RTCDevice device) {
  return {rtcNewScene(device), [](RTCScene scene) { rtcReleaseScene(scene); }};
}

}  // namespace

void RayPacket::start(const Eigen::Vector3f& origin) {
  for (int i = 0; i < kSize; ++i) {
    rays.ray.org_x[i] = origin.x();
    rays.ray.org_y[i] = origin.y();
    rays.ray.org_z[i] = origin.z();
    rays.ray.tnear[i] = kNear;
    rays.ray.time[i] = 0.0f;
    rays.ray.mask[i] = 0xffffffffu;
    rays.ray.id[i] = 0;
    rays.ray.flags[i] = 0;
  }
}

Device::Device(int threads) {
  const std::string config = "threads=" + std::to_string(threads);
  device_ = {rtcNewDevice(config.c_str()), [](RTCDevice device) {
               if (device) rtcReleaseDevice(device);
             }};
  if (!device_) throw std::runtime_error("Embree cannot start on this machine");
}

RayCaster::RayCaster(const Device& device, const Mesh& mesh) : scene_(newScene(device.get())) {
  RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_QUAD);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Eigen::Vector3f), mesh.vertices.size());
  void* quads = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, sizeof(Mesh::Quad),
                                        mesh.quads.size());
  if (!vertices || !quads) throw std::runtime_error("there is not enough memory for the world; use a shorter path");
  std::memcpy(vertices, mesh.vertices.data(), mesh.vertices.size() * sizeof(Eigen::Vector3f));
  std::memcpy(quads, mesh.quads.data(), mesh.quads.size() * sizeof(Mesh::Quad));
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_.get(), geometry);
  rtcReleaseGeometry(geometry);
  // Without this flag rays slip through the seams of the ground.
  rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
  rtcCommitScene(scene_.get());
}

void RayCaster::cast(RayPacket& packet) const {
  intersectTogether(scene_.get(), packet.valid, packet.rays);
}

bool RayCaster::occluded(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const {
  RTCRay ray = {};
  ray.org_x = origin.x();
  ray.org_y = origin.y();
  ray.org_z = origin.z();
  ray.dir_x = direction.x();
  ray.dir_y = direction.y();
  ray.dir_z = direction.z();
  ray.tnear = 0.02f;
  ray.tfar = std::numeric_limits<float>::infinity();
  ray.mask = 0xffffffffu;
  return isOccluded(scene_.get(), ray);
}

MovingScene::MovingScene(const Device& device, const std::vector<RayCaster>& models)
    : device_(device.get()), models_(&models) {}

void MovingScene::place(const std::vector<Traffic::Car>& cars) {
  cars_ = cars;
  if (cars_.empty()) {
    scene_.reset();
    return;
  }
  scene_ = newScene(device_);
  for (std::size_t i = 0; i < cars_.size(); ++i) {
    RTCGeometry instance = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, (*models_)[static_cast<std::size_t>(cars_[i].model)].scene());
    const Eigen::Matrix<float, 3, 4> transform = cars_[i].T_world_car.matrix().topRows<3>().cast<float>();
    rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform.data());
    rtcCommitGeometry(instance);
    rtcAttachGeometryByID(scene_.get(), instance, static_cast<unsigned>(i));
    rtcReleaseGeometry(instance);
  }
  rtcCommitScene(scene_.get());
}

void MovingScene::cast(RayPacket& packet) const {
  if (!scene_) return;
  intersectTogether(scene_.get(), packet.valid, packet.rays);
}

}  // namespace sdvo::render
