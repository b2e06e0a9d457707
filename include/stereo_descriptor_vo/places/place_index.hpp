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

/// A key frame by which a place is recognised: some of a pair's features, and the pair's pose.
struct Place {
  int id = 0;              ///< running number, from 0
  int segment = 0;         ///< counts the breaks, motions that are unknown
  double travelled = 0.0;  ///< distance since the start, m
  /// Pose as the odometry reported it. The corrected pose, T_map_camera, is a node of the graph.
  Eigen::Isometry3d T_odom_camera = Eigen::Isometry3d::Identity();
  StereoFeatures features;  ///< without patches

  /// Memory that it takes, without its words in the index.
  std::size_t bytes() const;
};

/// A pair with at most `most` of its features and without patches. They are spread over the image: the cells of an 8x4
/// grid take turns and give their strongest ones.
StereoFeatures thinOut(const StereoFeatures& features, int most);

/// The words of a place's descriptors, ascending, none twice. An index has nothing else of a place, and another robot
/// needs nothing else to ask whether a place is known.
using PlaceSignature = std::vector<std::uint32_t>;

/// A place that shares words with a query.
struct PlaceCandidate {
  int place;
  double score;  ///< in [0, 1]: share of the query's words that it has, weighted by their rarity
};

/// Finds places of similar appearance: an inverted index over words. There is no trained vocabulary: a word consists of
/// 18 fixed bits of a descriptor. Similar descriptors share some of their words (locality-sensitive hashing by sampled
/// bits, Indyk and Motwani 1998; weights as in text retrieval, Sivic and Zisserman 2003).
class PlaceIndex {
 public:
  // 18 bits make 262,144 words: few of a hundred thousand different descriptors share one by chance.
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
