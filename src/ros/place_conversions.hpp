#pragma once

#include <stereo_descriptor_vo/Place.h>
#include <stereo_descriptor_vo/PlaceInfo.h>
#include <stereo_descriptor_vo/PlaceMatch.h>
#include <stereo_descriptor_vo/PlaceSignature.h>
#include <stereo_descriptor_vo/StereoFeatures.h>

#include <string>

#include "stereo_descriptor_vo/front_end/depth_scale.hpp"
#include "stereo_descriptor_vo/places/place.hpp"
#include "stereo_descriptor_vo/places/place_index.hpp"
#include "stereo_descriptor_vo/places/place_recognition.hpp"

/// Where messages and the types of places meet.
namespace sdvo::ros_conversions {

/// What messages tell of a stream of features that the features themselves do not hold.
struct FeatureStream {
  std::string frame_id;  ///< of the camera
  DepthScaleOptions size_curve;
};
FeatureStream streamOf(const stereo_descriptor_vo::StereoFeatures& message);

stereo_descriptor_vo::Place toMessage(const Place& place, const std::string& robot, const FeatureStream& stream);
/// Throws std::invalid_argument when the message does not hold together; the result owns its memory.
Place fromMessage(const stereo_descriptor_vo::Place& message);

/// What the report tells; header and counts are the caller's to fill.
stereo_descriptor_vo::PlaceInfo toInfo(const PlaceReport& report);

stereo_descriptor_vo::PlaceSignature toMessage(const PlaceSignature& words, const Place& place,
                                               const PlaceIndexOptions& index, const std::string& robot,
                                               const std::string& frame_id);
/// Throws std::invalid_argument when the message's words are not such as `index` makes of rows like `kind`.
PlaceSignature fromMessage(const stereo_descriptor_vo::PlaceSignature& message, const PlaceIndexOptions& index,
                           const DescriptorKind& kind);

/// Names of robots are the caller's to fill.
stereo_descriptor_vo::PlaceMatch toMessage(const PlaceMatch& match, const Place& mine, const Place& other,
                                           const std::string& frame_id);

}  // namespace sdvo::ros_conversions
