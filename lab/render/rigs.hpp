#pragma once

#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo::render {

/// A stereo camera that render_drive knows by name.
struct Rig {
  std::string name;
  StereoCamera camera;
  double rate;   ///< pairs per second, Hz
  bool indoors;  ///< whether it drives through a room, unless told otherwise
};

/// kitti (sequences 04 to 10), euroc (rectified), and small cameras of robots with the lens in the middle.
const std::vector<Rig>& rigs();

/// Throws std::invalid_argument for another name.
const Rig& findRig(const std::string& name);

inline StereoCamera kittiCamera() {
  return findRig("kitti").camera;
}

}  // namespace sdvo::render
