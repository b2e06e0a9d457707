#pragma once

#include <string>
#include <vector>

#include "../messages/place_conversions.hpp"

namespace sdvo {

/// The places of a session and what holds them together, as SavePlaces.srv describes the file.
struct SavedPlaces {
  std::vector<Place> places;
  PoseGraph graph;
  ros_conversions::FeatureStream stream;  ///< of the first place
};

/// A file appears whole or not at all, in the place of another such file, or of any with `overwrite`. Throws
/// std::runtime_error as writeWhole() does.
void savePlaces(const std::vector<Place>& places, const ros_conversions::MapState& map,
                const ros_conversions::FeatureStream& stream, const std::string& robot, const std::string& map_frame,
                const std::string& path, bool overwrite);

/// Throws std::runtime_error that names the file when it is no such file or does not hold together.
SavedPlaces loadPlaces(const std::string& path);

}  // namespace sdvo
