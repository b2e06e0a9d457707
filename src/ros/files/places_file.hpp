#pragma once

#include <string>
#include <vector>

#include "../../messages/place_conversions.hpp"

namespace sdvo {

/// Content of a file of SavePlaces.srv.
struct SavedPlaces {
  std::vector<Place> places;
  PoseGraph graph;
  ros_conversions::FeatureStream stream;  ///< of the first place
};

/// Writes a file whole or not at all. It replaces an earlier file of places; any other file only with `overwrite`.
/// Throws std::runtime_error as writeWhole() does.
void savePlaces(const SavedPlaces& saved, const std::string& robot, const std::string& map_frame,
                const std::string& path, bool overwrite);

/// Throws std::runtime_error that names the file if it has another content or is inconsistent.
SavedPlaces loadPlaces(const std::string& path);

}  // namespace sdvo
