#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <unordered_map>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// A key frame that a camera may come back to: some of a pair's features and where they were seen from.
struct Place {
  int id = 0;              ///< running number, from 0
  int segment = 0;         ///< one more after each motion that is unknown
  double travelled = 0.0;  ///< way since the start, m
  /// As the odometry reported it; origin: of that odometry's pose. A map puts it somewhere else.
  Eigen::Isometry3d T_odom_camera = Eigen::Isometry3d::Identity();
  StereoFeatures features;  ///< without patches

  /// Of memory, without the index of its words.
  std::size_t bytes() const;
};

/// At most so many rows of a pair, spread over the image: each cell of an 8x4 grid gives its strongest ones in turn.
/// Patches are left behind.
StereoFeatures thinOut(const StereoFeatures& features, int most);

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
  // Words of 18 bits: a hundred thousand different rows share few by chance.
  static constexpr int kWordsPerRow = 4;
  static constexpr int kBitsPerWord = 18;

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

  std::map<int, PlaceSignature> places_;
  std::unordered_map<std::uint32_t, std::vector<int>> postings_;  ///< for each word, the places that have it, ascending
};

}  // namespace sdvo
