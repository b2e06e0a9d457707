#pragma once

#include <string>

#include "finding.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo {

/// Whether a camera that can be used is one that robots carry. `lens`: name of the lens model. `unrectified`: why its
/// images are most likely not rectified; empty: nothing speaks for it.
Finding checkCalibration(const StereoCamera& camera, const std::string& lens, const std::string& unrectified);

}  // namespace sdvo
