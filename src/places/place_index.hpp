#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <unordered_map>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/places/place.hpp"

namespace sdvo {

/// Finds places of similar appearance: an inverted index over words. There is no trained vocabulary: a word consists of
/// 18 fixed bits of a descriptor. Similar descriptors share some of their words (locality-sensitive hashing by sampled
/// bits, Indyk and Motwani 1998; weights as in text retrieval, Sivic and Zisserman 2003).
class PlaceIndex {
 public:
  // 18 bits make 262,144 words: a hundred thousand different descriptors put 0.4 into each by chance.
  static constexpr int kWordsPerRow = 4;
  static constexpr int kBitsPerWord = 18;

  /// Throws std::invalid_argument if the descriptors are not binary or are too short for the words.
  PlaceSignature signature(const StereoFeatures& features) const;

  /// Throws std::invalid_argument if the index already has this place.
  void add(int place, const PlaceSignature& signature);
  void remove(int place);

  /// At most `most` places that `admitted` accepts, the best score first. Rare words are looked up first. In a large
  /// map the most common ones are left out, so that the time hardly grows with the map.
  std::vector<PlaceCandidate> find(const PlaceSignature& signature, int most,
                                   const std::function<bool(int place)>& admitted) const;

 private:
  double weight(std::size_t having) const;

  std::map<int, PlaceSignature> places_;
  std::unordered_map<std::uint32_t, std::vector<int>> postings_;  ///< for each word, the places that have it, ascending
};

}  // namespace sdvo
