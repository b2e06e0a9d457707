#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "corner_pairs.hpp"
#include "finding.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo {

/// Focal length and principal point from the images. A rotation shifts the image more at its edges than in the middle,
/// by a ratio that depends on f and c. All motions, f, c and an offset of the disparities are estimated together.
class LensCheck {
 public:
  /// A point of the left image, with where it was in the left image before (all px).
  struct Track {
    double u, v, disparity, u_before, v_before;
  };
  void add(const StereoCamera& camera, const CornerPair& pair);
  /// With given tracks.
  void add(const StereoCamera& camera, const std::vector<Track>& tracks);

  /// Focal length as a ratio of camera_info's, less one; principal point less camera_info's, in focal lengths.
  struct Estimate {
    Eigen::Vector3d value, sigma;
    Eigen::Vector3d resolution;  ///< standard deviation at an error of 1 mrad in each point
  };
  std::optional<Estimate> estimate() const;

  Finding judge() const;

 private:
  /// In units of the focal length, from the principal point.
  struct Ray {
    Eigen::Vector2d now, before;
    double disparity;
  };
  StereoCamera camera_;
  std::vector<std::vector<Ray>> pairs_;
};

}  // namespace sdvo
