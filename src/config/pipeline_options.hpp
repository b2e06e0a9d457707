#pragma once

#include <string>
#include <vector>

#include "interface_options.hpp"
#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"
#include "stereo_descriptor_vo/places/place_recognition.hpp"

namespace sdvo {

/// The options of all nodelets that offline runs have, too, under the nodelets' names, so that one YAML file serves the launch files and the tools.
struct PipelineOptions {
  FeatureExtractorOptions stereo_features;
  VisualOdometryOptions visual_odometry;
  PlaceRecognitionOptions place_recognition;
  PairingOptions pairing;

  void describe(OptionList& list) {
    list.group("stereo_features", stereo_features);
    list.group("stereo_features", pairing);
    list.group("visual_odometry", visual_odometry);
    list.group("place_recognition", place_recognition);
  }
};

/// Options of the nodelets beside the core's. Tools accept and ignore them in a YAML file.
struct InterfaceOptions {
  StereoInputOptions stereo_features;
  OdometryOutputOptions visual_odometry;
  PlaceOutputOptions place_recognition;

  void describe(OptionList& list) {
    list.group("stereo_features", stereo_features);
    list.group("visual_odometry", visual_odometry);
    list.group("place_recognition", place_recognition);
  }
};

/// Options from a YAML file (empty name: none) and from "name=value" settings, which win. Throws std::runtime_error
/// that names the file, or std::invalid_argument that names the option, when an option is unknown or out of its range
/// or when options do not go together.
PipelineOptions readPipelineOptions(const std::string& yaml_file, const std::vector<std::string>& settings);

}  // namespace sdvo
