#include "rigs.hpp"

#include <stdexcept>

namespace sdvo::render {

namespace {

constexpr double kIndoorRate = 20.0;  // Hz

/// The principal point is the middle of the image.
Rig robotCamera(const std::string& name, int width, int height, double focal_length, double baseline) {
  return {name,
          {focal_length, focal_length, 0.5 * (width - 1), 0.5 * (height - 1), baseline, width, height},
          kIndoorRate,
          true};
}

}  // namespace

const std::vector<Rig>& rigs() {
  static const std::vector<Rig> all = {
      {"kitti", {707.0912, 707.0912, 601.8873, 183.1104, 379.8145 / 707.0912, 1241, 376}, 10.0, false},
      {"euroc", {436.2, 436.2, 367.2, 252.2, 0.110, 752, 480}, kIndoorRate, true},
      robotCamera("d435", 848, 480, 425.0, 0.050),
      robotCamera("d435_small", 424, 240, 212.5, 0.050),
      robotCamera("zed_mini", 672, 376, 350.0, 0.063),
      robotCamera("oak_d", 640, 400, 450.0, 0.075),
  };
  return all;
}

const Rig& findRig(const std::string& name) {
  for (const Rig& rig : rigs())
    if (rig.name == name) return rig;
  throw std::invalid_argument("there is no rig '" + name + "'");
}

}  // namespace sdvo::render
