#include "place_conversions.hpp"

#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "feature_conversions.hpp"
#include "frame_id.hpp"
#include "message_numbers.hpp"
#include "pose_conversions.hpp"
#include "stamps.hpp"

namespace sdvo::ros_conversions {
namespace msgs = stereo_descriptor_vo;

FeatureStream streamOf(const msgs::StereoFeatures& message) {
  FeatureStream stream;
  stream.frame_id = cleanFrameId(message.header.frame_id);
  DepthScaleOptions& curve = stream.size_curve;
  curve.scale_normalisation = message.scale_normalised;
  curve.slope = message.size_slope;
  curve.exponent = message.size_exponent;
  curve.offset = message.size_offset;
  if (message.scale_normalised)
    curve.min_size = message.size_min, curve.max_size = message.size_max;
  else
    curve.constant_size = message.size_min;
  return stream;
}

msgs::Place toMessage(const Place& place, const std::string& robot, const FeatureStream& stream) {
  msgs::Place message;
  message.robot = robot;
  message.id = static_cast<std::uint32_t>(place.id);
  message.pose = tf2::toMsg(place.T_odom_camera);
  message.segment = static_cast<std::uint32_t>(place.segment);
  message.travelled = place.travelled;
  message.features = toMessage(place.features, stream.size_curve);
  message.features.header.stamp = toTime(place.features.stamp);
  message.features.header.frame_id = stream.frame_id;
  return message;
}

Place fromMessage(const msgs::Place& message) {
  Place place;
  place.id = toInt(message.id, "id");
  place.T_odom_camera = toPose(message.pose);
  place.segment = toInt(message.segment, "segment");
  if (!std::isfinite(message.travelled)) throw std::invalid_argument("travelled is not finite");
  place.travelled = message.travelled;
  const std::string problem = whyUnusable(message.features.header.stamp);
  if (!problem.empty()) throw std::invalid_argument(problem);
  place.features = fromMessage(message.features);
  return place;
}

msgs::PlaceInfo toInfo(const PlaceReport& report) {
  msgs::PlaceInfo info;
  info.id = static_cast<std::uint32_t>(report.id);
  for (const PlaceCandidate& candidate : report.candidates) {
    info.candidates.push_back(static_cast<std::uint32_t>(candidate.place));
    info.scores.push_back(static_cast<float>(candidate.score));
  }
  info.same = report.same ? *report.same : -1;
  info.loop = report.loop;
  info.reason = report.reason;
  info.matches = static_cast<std::uint32_t>(report.match.matches);
  info.inliers = static_cast<std::uint32_t>(report.match.inliers);
  info.coverage = static_cast<float>(report.match.coverage);
  info.rms_reprojection_error = static_cast<float>(report.match.rms);
  info.find_time = static_cast<float>(report.find_time);
  info.verify_time = static_cast<float>(report.verify_time);
  return info;
}

msgs::PlaceSignature toMessage(const PlaceSignature& words, const Place& place, const PlaceIndexOptions& index,
                               const std::string& robot, const std::string& frame_id) {
  msgs::PlaceSignature message;
  message.header.stamp = toTime(place.features.stamp);
  message.header.frame_id = frame_id;
  message.robot = robot;
  message.id = static_cast<std::uint32_t>(place.id);
  const DescriptorKind kind = place.features.kind();
  message.descriptor = kind.descriptor;
  message.layout = nameOf(kind.layout);
  message.element_type = nameOf(kind.element_type);
  message.bytes_per_row = static_cast<std::uint32_t>(kind.bytes);
  message.words_per_row = static_cast<std::uint32_t>(index.words_per_row);
  message.bits_per_word = static_cast<std::uint32_t>(index.bits_per_word);
  message.words = words;
  return message;
}

PlaceSignature fromMessage(const msgs::PlaceSignature& message, const PlaceIndexOptions& index,
                           const DescriptorKind& kind) {
  const auto refuse = [](const std::string& what) {
    throw std::invalid_argument("PlaceSignature message refused: " + what);
  };
  if (message.words_per_row != static_cast<std::uint32_t>(index.words_per_row) ||
      message.bits_per_word != static_cast<std::uint32_t>(index.bits_per_word))
    refuse(std::to_string(message.words_per_row) + " words of " + std::to_string(message.bits_per_word) +
           " bits for a row, here " + std::to_string(index.words_per_row) + " of " +
           std::to_string(index.bits_per_word) + ": set index/… alike in both robots");
  if (message.descriptor != kind.descriptor || message.layout != nameOf(kind.layout) ||
      message.element_type != nameOf(kind.element_type) ||
      message.bytes_per_row != static_cast<std::uint32_t>(kind.bytes))
    refuse("descriptors " + message.descriptor + ", " + message.layout + ", " + std::to_string(message.bytes_per_row) +
           " bytes, here " + toString(kind) + ": set descriptor/… alike in both robots");
  constexpr std::size_t kMostWords = 1u << 18;
  if (message.words.size() > kMostWords) refuse(std::to_string(message.words.size()) + " words");
  if (std::adjacent_find(message.words.begin(), message.words.end(), std::greater_equal<>()) != message.words.end())
    refuse("words that do not ascend");
  const std::uint64_t end = static_cast<std::uint64_t>(index.words_per_row) << index.bits_per_word;
  if (!message.words.empty() && message.words.back() >= end) refuse("a word beyond the largest one");
  return message.words;
}

msgs::PlaceMatch toMessage(const PlaceMatch& match, const Place& mine, const Place& other,
                           const std::string& frame_id) {
  msgs::PlaceMatch message;
  message.header.stamp = toTime(mine.features.stamp);
  message.header.frame_id = frame_id;
  message.id = static_cast<std::uint32_t>(mine.id);
  message.other_id = static_cast<std::uint32_t>(other.id);
  message.other_stamp = toTime(other.features.stamp);
  message.pose = toMessage(match.T_place_camera, match.covariance);
  message.matches = static_cast<std::uint32_t>(match.matches);
  message.inliers = static_cast<std::uint32_t>(match.inliers);
  message.coverage = static_cast<float>(match.coverage);
  message.rms_reprojection_error = static_cast<float>(match.rms);
  return message;
}

}  // namespace sdvo::ros_conversions
