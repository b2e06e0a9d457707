#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <unordered_map>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

struct PlaceIndexOptions {
  int words_per_row = 4;
  int bits_per_word = 18;

  void describe(OptionList& list) {
    list.add("words_per_row", words_per_row, {1, 16}, "", "words that stand for a descriptor in the index");
    list.add("bits_per_word", bits_per_word, {8, 24}, "bit", "bits of the descriptor in each of its words");
  }
};

/// The words of a place's rows, ascending, none twice: what an index knows of it, and all that another robot needs to
/// ask whether a place is known.
using PlaceSignature = std::vector<std::uint32_t>;

/// A place that shares words with what was asked for.
struct PlaceCandidate {
  int place;
  double score;  ///< in [0, 1]: share of the words asked for that it has, weighed by their rarity
};

/// Finds places by what they look like: an inverted index over words made of descriptors' bits. There is no trained
/// vocabulary: a word is some of a row's bits as they are, always the same ones. Rows that look alike share some of
/// their words (locality-sensitive hashing by sampled bits, Indyk and Motwani 1998; weights as in text retrieval,
/// Sivic and Zisserman 2003).
class PlaceIndex {
 public:
  explicit PlaceIndex(const PlaceIndexOptions& options);

  /// Throws std::invalid_argument where the rows are not made of bits or too short for the words.
  PlaceSignature signature(const StereoFeatures& features) const;

  /// `place` must not be in it.
  void add(int place, const PlaceSignature& signature);
  void remove(int place);

  /// Places by falling score, at most so many; only those that `admitted` says yes to. Rare words are asked first and
  /// common ones not at all in a large map, so that the time hardly grows with it.
  std::vector<PlaceCandidate> find(const PlaceSignature& signature, int most,
                                   const std::function<bool(int place)>& admitted) const;

  int count() const { return static_cast<int>(places_.size()); }

 private:
  double weight(std::size_t having) const;

  PlaceIndexOptions options_;
  std::map<int, PlaceSignature> places_;
  std::unordered_map<std::uint32_t, std::vector<int>> postings_;  ///< for each word, the places that have it, ascending
};

}  // namespace sdvo
