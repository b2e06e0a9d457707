// What another robot sends of its places: a PlaceSignature, and a Place as GetPlace's answer. Each is refused with one
// std::invalid_argument, or it can be compared with the places known here, and what comes out is finite.

#include "../../src/messages/place_conversions.hpp"
#include "../../src/messages/pose_conversions.hpp"
#include "fuzz_message.hpp"
#include "fuzz_places.hpp"

namespace {

using namespace sdvo;
namespace msgs = stereo_descriptor_vo;

void damage(msgs::PlaceSignature& message, FuzzBytes& bytes) {
  replace(message.descriptor, bytes), replace(message.layout, bytes), replace(message.element_type, bytes);
  replace(message.bytes_per_row, bytes), replace(message.words_per_row, bytes), replace(message.bits_per_word, bytes);
  sdvo::damage(message.words, bytes);
}

void findThat(const msgs::PlaceSignature& message, const PlaceRecognition& known) {
  const DescriptorKind kind = known.places().begin()->second.features.kind();
  for (const PlaceCandidate& candidate : known.find(ros_conversions::fromMessage(message, kind)))
    if (known.places().count(candidate.place) == 0 || !(candidate.score > 0.0 && candidate.score <= 1.0))
      __builtin_trap();
}

void compareWith(const msgs::Place& message, const PlaceRecognition& known) {
  const Place other = ros_conversions::fromMessage(message);
  const PlaceMatch match = known.verify(1, other.features);
  if (!match.same) return;
  const msgs::PlaceMatch found = ros_conversions::toMessage(match, known.places().at(1), other, "left_optical");
  Eigen::Isometry3d pose;
  Matrix6d covariance;
  try {
    ros_conversions::fromMessage(found.pose, pose, covariance);
  } catch (const std::invalid_argument&) {
    __builtin_trap();  // another one could not read what we say
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzBytes bytes(data, size);
  static const PlaceRecognition known = [] {
    PlaceRecognition recognition{PlaceRecognitionOptions()};
    const SavedPlaces some = fuzz::somePlaces();
    recognition.restore(some.places, some.graph);
    return recognition;
  }();
  const Place& place = known.places().at(2);
  msgs::PlaceSignature signature = ros_conversions::toMessage(known.signature(2), place, "/other", "left_optical");
  msgs::Place answer = ros_conversions::toMessage(place, "/other", fuzz::someStream());
  damage(signature, bytes);
  fuzz::damage(answer, bytes);
  try {
    findThat(signature, known);
  } catch (const std::invalid_argument&) {
  }
  try {
    compareWith(answer, known);
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
