#include "place_index.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>

namespace sdvo {
namespace {

/// Indices of the bits of all words, one word after the other, no bit twice. They depend only on the row's length.
std::vector<int> sampleBits(int row_bits, int count) {
  std::vector<int> bits(static_cast<std::size_t>(row_bits));
  std::iota(bits.begin(), bits.end(), 0);
  std::minstd_rand random;  // the same numbers on every platform; std::shuffle would use them differently
  for (int i = 0; i < count; ++i) std::swap(bits[i], bits[i + static_cast<int>(random() % (row_bits - i))]);
  bits.resize(static_cast<std::size_t>(count));
  return bits;
}

}  // namespace

std::size_t Place::bytes() const {
  std::size_t bytes = sizeof(Place) + features.descriptors.total() * features.descriptors.elemSize();
  StereoFeatures::forEachArray([&](auto array, auto) { bytes += (features.*array).size() * sizeof(float); });
  return bytes;
}

StereoFeatures thinOut(const StereoFeatures& features, int most) {
  constexpr int kColumns = 8, kRows = 4;
  std::array<std::vector<int>, kColumns * kRows> cells;
  for (int i = 0; i < features.count(); ++i) {
    const int column = static_cast<int>(features.u[i] * kColumns / static_cast<float>(features.camera.width));
    const int row = static_cast<int>(features.v[i] * kRows / static_cast<float>(features.camera.height));
    cells[std::clamp(row, 0, kRows - 1) * kColumns + std::clamp(column, 0, kColumns - 1)].push_back(i);
  }
  for (std::vector<int>& cell : cells)
    std::stable_sort(cell.begin(), cell.end(),
                     [&](int a, int b) { return features.response[a] > features.response[b]; });

  std::vector<int> indices;
  const auto wanted = static_cast<std::size_t>(std::min(most, features.count()));
  for (std::size_t turn = 0; indices.size() < wanted; ++turn)
    for (const std::vector<int>& cell : cells)
      if (turn < cell.size() && indices.size() < wanted) indices.push_back(cell[turn]);
  StereoFeatures thinned = features.select(indices);
  thinned.patches = cv::Mat();
  thinned.patch_layout = {};
  return thinned;
}

PlaceSignature PlaceIndex::signature(const StereoFeatures& features) const {
  const int row_bits = 8 * features.descriptors.cols;
  constexpr int needed = kWordsPerRow * kBitsPerWord;
  if (features.count() > 0 && (features.element_type != ElementType::kBits || row_bits < needed))
    throw std::invalid_argument("places are recognised by rows of at least " + std::to_string(needed) +
                                " bits, not by " + toString(features.kind()));
  PlaceSignature words;
  if (features.count() == 0) return words;
  const std::vector<int> bits = sampleBits(row_bits, needed);
  words.reserve(static_cast<std::size_t>(features.count()) * kWordsPerRow);
  for (int i = 0; i < features.count(); ++i) {
    const std::uint8_t* row = features.descriptors.ptr(i);
    auto bit = bits.begin();
    for (int w = 0; w < kWordsPerRow; ++w) {
      auto word = static_cast<std::uint32_t>(w);
      for (int b = 0; b < kBitsPerWord; ++b, ++bit) word = word << 1 | (row[*bit / 8] >> (*bit % 8) & 1u);
      words.push_back(word);
    }
  }
  std::sort(words.begin(), words.end());
  words.erase(std::unique(words.begin(), words.end()), words.end());
  return words;
}

void PlaceIndex::add(int place, const PlaceSignature& signature) {
  if (!places_.emplace(place, signature).second)
    throw std::invalid_argument("place " + std::to_string(place) + " is in the index already");
  for (const std::uint32_t word : signature) {
    std::vector<int>& posting = postings_[word];
    posting.insert(std::upper_bound(posting.begin(), posting.end(), place), place);
  }
}

void PlaceIndex::remove(int place) {
  const auto entry = places_.find(place);
  if (entry == places_.end()) return;
  for (const std::uint32_t word : entry->second) {
    std::vector<int>& posting = postings_[word];
    posting.erase(std::lower_bound(posting.begin(), posting.end(), place));
    if (posting.empty()) postings_.erase(word);
  }
  places_.erase(entry);
}

/// Weight of a word that `having` places have.
double PlaceIndex::weight(std::size_t having) const {
  return std::log1p(static_cast<double>(places_.size()) / static_cast<double>(having));
}

std::vector<PlaceCandidate> PlaceIndex::find(const PlaceSignature& signature, int most,
                                             const std::function<bool(int place)>& admitted) const {
  if (places_.empty()) return {};
  const int first = places_.begin()->first, last = places_.rbegin()->first;
  // The rarest words first: common ones distinguish places little, and are left out beyond this number of look-ups.
  constexpr std::size_t kLookups = 100'000;
  std::vector<const std::vector<int>*> postings;
  for (const std::uint32_t word : signature) {
    const auto posting = postings_.find(word);
    if (posting != postings_.end()) postings.push_back(&posting->second);
  }
  std::stable_sort(postings.begin(), postings.end(),
                   [](const auto* a, const auto* b) { return a->size() < b->size(); });
  double all = weight(1) * static_cast<double>(signature.size() - postings.size());
  std::vector<double> weights(static_cast<std::size_t>(last - first) + 1, 0.0);
  std::size_t lookups = 0;
  for (const std::vector<int>* posting : postings) {
    const double w = weight(posting->size());
    all += w;
    lookups += posting->size();
    if (lookups > kLookups) break;
    for (const int place : *posting) weights[place - first] += w;
  }
  std::vector<PlaceCandidate> candidates;
  for (const auto& [place, words] : places_)
    if (weights[place - first] > 0.0 && admitted(place)) candidates.push_back({place, weights[place - first] / all});
  const auto end = candidates.begin() + std::min<std::ptrdiff_t>(most, static_cast<std::ptrdiff_t>(candidates.size()));
  std::partial_sort(candidates.begin(), end, candidates.end(), [](const PlaceCandidate& a, const PlaceCandidate& b) {
    return a.score != b.score ? a.score > b.score : a.place < b.place;
  });
  candidates.erase(end, candidates.end());
  return candidates;
}

}  // namespace sdvo
