#pragma once

#include <string>

#include "finding.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo {

/// Whether a valid calibration is plausible for a robot's camera. `lens`: name of the lens model. `unrectified`:
/// evidence that the images are not rectified; empty: none.
Finding checkCalibration(const StereoCamera& camera, const std::string& lens, const std::string& unrectified);

}  // namespace sdvo
