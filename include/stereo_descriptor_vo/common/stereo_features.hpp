#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/descriptor_format.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo {

/// Whether rows of descriptors can be compared: only those of the same kind can.
struct DescriptorKind {
  std::string descriptor;  ///< base descriptor: "freak", …
  DescriptorLayout layout = DescriptorLayout::kLeft;
  ElementType element_type = ElementType::kBits;
  int bytes = 0;  ///< of a row

  bool operator==(const DescriptorKind& other) const;
  bool operator!=(const DescriptorKind& other) const { return !(*this == other); }
};

/// In words, for messages.
std::string toString(const DescriptorKind& kind);

/// Measurements of a pair that only the image side can make. They are sent with the features.
struct ExtractionReport {
  int detected = 0;                       ///< corners in the left image, before stereo matching
  int stereo_matched = 0;                 ///< of these, found in the right image
  double mean_intensity[2] = {0.0, 0.0};  ///< left and right, grey levels 0…255
  double sharpness[2] = {0.0, 0.0};       ///< left and right, mean absolute horizontal gradient, grey levels per px
  double noise = 0.0;          ///< left, standard deviation, grey levels; fine texture adds to it; 0: not measured
  double detect_time = 0.0;    ///< s
  double stereo_time = 0.0;    ///< s
  double describe_time = 0.0;  ///< s
  bool refused = false;        ///< by the rig monitor: rows do not agree, `status` names the cause
  bool along_rows = false;     ///< the right camera turned: matched along the rows that the monitor found
  std::string status;          ///< empty, or why the pair gave few or no features
};

/// One row of StereoFeatures without its descriptor and its patch; meaning and units as there.
struct StereoFeature {
  float u, v, disparity, dv, size, angle, response;
};

/// Features of one rectified stereo pair as parallel arrays: element i of each belongs to row i of `descriptors`.
/// This is the noun that flows from the image side to the motion side.
struct StereoFeatures {
  std::int64_t stamp = 0;  ///< of the left image, ns
  StereoCamera camera;
  double right_delay = 0.0;  ///< s, from the left image to the right one, where each camera has its own trigger

  std::string descriptor;  ///< base descriptor: "freak", …; a free name, for other extractors may send their own
  DescriptorLayout layout = DescriptorLayout::kLeft;
  ElementType element_type = ElementType::kBits;

  std::vector<float> u, v;       ///< left position, px
  std::vector<float> disparity;  ///< u_left - u_right > 0, px
  std::vector<float> dv;         ///< v_right - v_left, px: the rig's residual misalignment shows here
  std::vector<float> size;       ///< of the cv::KeyPoint, px: scales the described neighbourhood and the patch
  std::vector<float> angle;      ///< rad in [0, 2 pi), -1 where the descriptor is not oriented
  std::vector<float> response;   ///< detector's score
  cv::Mat descriptors;           ///< rows x bytes, CV_8U; elements wider than a byte in the machine's own order

  PatchLayout patch_layout;
  cv::Mat patches;  ///< of the left view, rows x patch_layout.bytes(), CV_8U; empty where none are sent

  ExtractionReport report;

  int count() const { return static_cast<int>(u.size()); }

  DescriptorKind kind() const { return {descriptor, layout, element_type, descriptors.cols}; }

  bool hasPatches() const { return patch_layout.side > 0; }

  /// Adds a row to every array; its descriptor and its patch go into the matrices separately.
  void append(const StereoFeature& feature);
  /// Memory for so many of them.
  void reserve(int count);

  /// The same pair with some of its features, in the order given.
  StereoFeatures select(const std::vector<int>& indices) const;

  /// The same points in pixels of another camera: their rays and depths stay.
  StereoFeatures seenBy(const StereoCamera& other) const;

  /// (u_left, v_left, u_right) of feature i, px.
  Eigen::Vector3d measurement(int i) const { return {u[i], v[i], static_cast<double>(u[i]) - disparity[i]}; }

  /// Position of feature i in the left optical frame, m.
  Eigen::Vector3d point(int i) const { return camera.backProject(u[i], v[i], disparity[i]); }

  /// Throws std::invalid_argument when arrays differ in length, a number is not finite or not positive where it must
  /// be, or the descriptors are not rows of whole elements.
  void check() const;

  /// Calls visit(array, other) with pointers to members of one name, for each array of numbers: of a row, or of the
  /// message.
  template <class Other = StereoFeature, class Visit>
  static void forEachArray(const Visit& visit) {
    visit(&StereoFeatures::u, &Other::u);
    visit(&StereoFeatures::v, &Other::v);
    visit(&StereoFeatures::disparity, &Other::disparity);
    visit(&StereoFeatures::dv, &Other::dv);
    visit(&StereoFeatures::size, &Other::size);
    visit(&StereoFeatures::angle, &Other::angle);
    visit(&StereoFeatures::response, &Other::response);
  }
};

}  // namespace sdvo
