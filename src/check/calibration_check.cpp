#include "calibration_check.hpp"

#include <cmath>
#include <sstream>

#include "../common/text.hpp"

namespace sdvo {
namespace {

/// An implausible value of the camera, in words; empty: all are plausible.
std::string doubtOf(const StereoCamera& camera) {
  // Range of robots' stereo cameras: fields of view of 6 to 170 deg, baselines of 3 mm (endoscopes) to 4 m (ships). The
  // principal point's distance from the centre as a ratio of the size: 0.25 for half of the right cx or cy, as after
  // binning. It is larger for cy, because rows of the sky are cut off.
  constexpr double kNarrowest = 0.1, kWidest = 22.9, kShortest = 0.003, kLongest = 4.0, kAside = 0.2, kAbove = 0.4;
  const double width = camera.width / camera.fx;
  const double aside = std::abs(camera.cx / camera.width - 0.5), above = std::abs(camera.cy / camera.height - 0.5);
  std::ostringstream doubt;
  if (width < kNarrowest || width > kWidest)
    doubt << "fx = " << camera.fx << " px at a width of " << camera.width
          << " px: is the focal length that of these images' size?";
  else if (aside > kAside || above > kAbove)
    doubt << "the principal point (" << camera.cx << ", " << camera.cy
          << ") is far from the centre: is camera_info that "
          << "of another size? With binning_x K and P are those of the whole sensor";
  else if (camera.baseline > kLongest)
    doubt << "baseline = " << camera.baseline << " m: is P[3] of the right camera_info in pixels times mm or cm? It "
          << "must be -fx * baseline with the baseline in metres";
  else if (camera.baseline < kShortest)
    doubt << "baseline = " << 1e3 * camera.baseline << " mm: does P[3] of the right camera_info lack the factor fx? It "
          << "must be -fx * baseline with the baseline in metres";
  return doubt.str();
}

}  // namespace

Finding checkCalibration(const StereoCamera& camera, const std::string& lens, const std::string& unrectified) {
  const std::string what = text(1, camera.width, "x", camera.height, ", f ", camera.fx, " px, baseline ",
                                1e3 * camera.baseline, " mm, ", lens.empty() ? "no lens model" : lens);
  const std::string doubt = doubtOf(camera);
  const std::string remedy = doubt + (doubt.empty() || unrectified.empty() ? "" : "; ") + unrectified;
  return {remedy.empty() ? Verdict::kOk : Verdict::kWarn, what, remedy};
}

}  // namespace sdvo
