#pragma once

#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/descriptor_format.hpp"
#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo {

enum class DetectorType { kFast, kGftt, kOrb, kSift };

inline const std::vector<std::string>& namesOf(DetectorType) {
  static const std::vector<std::string> names = {"fast", "gftt", "orb", "sift"};
  return names;
}

struct FeatureDetectorOptions {
  DetectorType type = DetectorType::kFast;
  int max_features = 600;
  int bucket_size = 50;  ///< px, side of the squares that share the corners evenly (chosen)
  double min_spacing = 0.0;
  double min_contrast = 9.0;
  double corner_quality = 0.002;  ///< gftt: weakest response relative to the best (chosen)
  bool subpixel = true;
  std::string mask;

  void describe(OptionList& list) {
    list.add("type", type, "corner detector");
    list.add("max_features", max_features, {1, 20000}, "", "corners kept per left image");
    list.add("min_spacing", min_spacing, {0.0, 100.0}, "px",
             "corners nearer than this to a stronger one are left out; 0: none is");
    list.add("min_contrast", min_contrast, {1.0, 100.0}, "sigma of the image's noise",
             "fast, orb: weakest corner considered; down to a quarter of it where there are too few");
    list.add("subpixel", subpixel, "fast, gftt: refine corners to sub-pixel positions");
    list.add("mask", mask, "PNG (absolute path) of the left image's size: no corners where it is black; empty: none");
  }
  /// Throws std::invalid_argument when the OpenCV at hand lacks the detector.
  void check() const;
};

struct EpipolarOptions {
  double max_disparity = 192.0;
  double uniqueness = 0.9;       ///< largest ratio of the best difference to the best elsewhere (chosen)
  double min_correlation = 0.8;  ///< of the aligned patches (chosen)

  void describe(OptionList& list) {
    list.add("max_disparity", max_disparity, {4.0, 2000.0}, "px", "largest disparity looked for, before alignment");
  }
};

struct StereoMatcherOptions {
  EpipolarOptions epipolar;
  double max_epipolar_residual = 1.5;
  double min_disparity = 0.5;  ///< px, of a point at finite depth (chosen)

  void describe(OptionList& list) {
    list.group("epipolar", epipolar);
    list.add("max_epipolar_residual", max_epipolar_residual, {0.1, 4.0}, "px",
             "largest difference of the rows in both views; KITTI's rectification really leaves up to 1.3");
  }
  /// Throws std::invalid_argument when no disparity is left to look for.
  void check() const;
};

struct RigMonitorOptions {
  double suspicious_share = 0.4;  ///< the rig is looked at if a smaller ratio of corners is matched; 0: never
};

/// The base descriptors, also those that the OpenCV at hand lacks.
enum class DescriptorType { kBrief, kBrisk, kFreak, kOrb, kSift, kSurf };

inline const std::vector<std::string>& namesOf(DescriptorType) {
  static const std::vector<std::string> names = {"brief", "brisk", "freak", "orb", "sift", "surf"};
  return names;
}

/// Size of a feature's neighbourhood from its stereo depth (paper, section 4.1). A circle of fixed size in the world
/// has an image radius proportional to 1/Z, that is to the disparity; in disparity the curve is the same for every rig.
/// Slope and limits of 0 are those of the base descriptor, see completedFor().
struct DepthScaleOptions {
  static constexpr double kStandardSize = 7.0;  ///< px, of a FAST corner: descriptors are published for it

  bool scale_normalisation = true;  ///< false: every feature has constant_size, which the lab compares with
  double slope = 0.0;
  double exponent = 1.0;  ///< of the disparity: a fixed circle in the world (paper)
  double offset = 0.0;    ///< px (paper)
  double min_size = 0.0;
  double max_size = 0.0;
  double constant_size = kStandardSize;

  void describe(OptionList& list) {
    list.add("slope", slope, {0.0, 100.0}, "px", "size by disparity, within the limits; 0: the one of descriptor/type");
    list.add("min_size", min_size, {0.0, 200.0}, "px",
             "smallest key point diameter, at least 2 px; 0: the one of descriptor/type");
    list.add("max_size", max_size, {0.0, 400.0}, "px",
             "largest key point diameter, at least min_size; 0: the one of descriptor/type");
  }

  /// The same with the base descriptor's own slope and limits in place of zeros. A descriptor that depth does not help
  /// has its standard size as both limits.
  DepthScaleOptions completedFor(DescriptorType type) const;
};

struct DescriptorOptions {
  DescriptorType type = DescriptorType::kFreak;
  DescriptorLayout layout = DescriptorLayout::kLeftAndRight;
  bool oriented = false;
  bool extend_border = true;

  /// px: a key point whose own size does not fit into the image is described if this size does, on an image extended
  /// by its border pixels. Chosen: with 7 px, 17 % of a near view's corners stay undescribed at 424x240, with 5 px 6 %.
  static constexpr double kInsideSize = 5.0;

  void describe(OptionList& list);
  /// Throws std::invalid_argument when the OpenCV at hand lacks the base descriptor.
  void check() const;
};

struct PatchOptions {
  int patch_side = 13;

  void describe(OptionList& list) {
    list.add("patch_side", patch_side, {0, kMostSamples}, "samples",
             "side of the grey patch sent with each feature, for its alignment between pairs; 0: none is sent");
  }

  /// Samples are a tenth of the feature's size apart, and at least 1 px.
  PatchLayout layout() const { return {patch_side, 1.f, 0.1f}; }

  static constexpr int kMostSamples = 16;
};

struct FeatureExtractorOptions {
  FeatureDetectorOptions detector;
  StereoMatcherOptions stereo;
  RigMonitorOptions rig_monitor;
  DepthScaleOptions size_curve;
  DescriptorOptions descriptor;
  PatchOptions patch;

  void describe(OptionList& list) {
    list.group("detector", detector);
    list.group("stereo", stereo);
    list.group("size_curve", size_curve);
    list.group("descriptor", descriptor);
    list.group("descriptor", patch);
  }
  /// Throws std::invalid_argument when the size curve leaves no size.
  void check() const;

  /// The size curve with the descriptor's own values where the options leave them open.
  DepthScaleOptions sizeCurve() const { return size_curve.completedFor(descriptor.type); }
};

}  // namespace sdvo
