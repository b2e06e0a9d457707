#include <gtest/gtest.h>

#include "../../src/places/place_index.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_place_index {

using Rows = std::vector<std::vector<std::uint8_t>>;

Rows randomRows(unsigned seed, int count) {
  std::mt19937 random(seed);
  Rows rows;
  for (int i = 0; i < count; ++i) rows.push_back(synthetic::randomRow(random, 128));
  return rows;
}

/// Features with these rows, a share of the bits of each turned over.
StereoFeatures show(const Rows& rows, double flipped = 0.0, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  StereoFeatures features = synthetic::noFeatures(synthetic::camera());
  for (std::vector<std::uint8_t> row : rows) {
    for (std::uint8_t& byte : row)
      for (int bit = 0; bit < 8; ++bit)
        if (uniform(random) < flipped) byte = static_cast<std::uint8_t>(byte ^ (1 << bit));
    synthetic::addFeature(features, 100.0, 100.0, 5.0, row);
  }
  return features;
}

bool anyPlace(int) {
  return true;
}

TEST(PlaceIndex, FindsAPlaceAmongManyWhenAnEighthOfTheBitsDiffer) {
  PlaceIndex index;
  for (int place = 0; place < 300; ++place) index.add(place, index.signature(show(randomRows(place, 200))));
  for (const int place : {0, 150, 299}) {
    const PlaceSignature asked = index.signature(show(randomRows(place, 200), 0.125, 7));
    const auto found = index.find(asked, 3, anyPlace);
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found.front().place, place);
    ASSERT_EQ(found.size(), 3u);
    EXPECT_LT(found[1].score, 0.3 * found[0].score);
  }
}

TEST(PlaceIndex, ScoresTheShareOfWhatWasAskedFor) {
  PlaceIndex index;
  const Rows all = randomRows(1, 100);
  const Rows half(all.begin(), all.begin() + 50);
  index.add(3, index.signature(show(half)));
  index.add(8, index.signature(show(all)));
  const auto found = index.find(index.signature(show(all)), 5, anyPlace);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].place, 8);
  EXPECT_NEAR(found[0].score, 1.0, 1e-9);
  EXPECT_LT(found[1].score, 0.5) << "half of the words, and those that both have say less";
}

TEST(PlaceIndex, WordsThatEverybodyHasSayNothing) {
  PlaceIndex index;
  const Rows common = randomRows(99, 150);
  for (int place = 0; place < 20; ++place) {
    Rows rows = randomRows(place, 20);
    rows.insert(rows.end(), common.begin(), common.end());
    index.add(place, index.signature(show(rows)));
  }
  Rows asked = randomRows(13, 20);
  asked.insert(asked.end(), common.begin(), common.begin() + 20);
  const auto found = index.find(index.signature(show(asked)), 2, anyPlace);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].place, 13);
  EXPECT_LT(found[1].score, 0.25) << "half of the words asked for";
}

TEST(PlaceIndex, FindsOnlyWhatIsAdmittedAndNotWhatWasRemoved) {
  PlaceIndex index;
  const PlaceSignature words = index.signature(show(randomRows(1, 100)));
  index.add(1, words);
  index.add(2, words);
  index.add(5, words);
  const auto found = index.find(words, 10, [](int place) { return place != 2; });
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].place, 1) << "the older one of equals";
  EXPECT_EQ(found[1].place, 5);
  index.remove(1);
  index.remove(1);
  ASSERT_EQ(index.find(words, 10, anyPlace).size(), 2u);
  EXPECT_EQ(index.find(words, 10, anyPlace)[0].place, 2);
  EXPECT_EQ(index.find(words, 1, anyPlace).size(), 1u);
}

TEST(PlaceIndex, AnEmptyOneAndAnEmptyPlaceAreNoError) {
  PlaceIndex index;
  const PlaceSignature nothing = index.signature(show({}));
  EXPECT_TRUE(nothing.empty());
  EXPECT_TRUE(index.find(index.signature(show(randomRows(1, 10))), 3, anyPlace).empty());
  index.add(1, nothing);
  EXPECT_TRUE(index.find(nothing, 3, anyPlace).empty());
}

TEST(PlaceIndex, ASignatureOf500FeaturesFitsIntoEightKilobytes) {
  const PlaceIndex index;
  const PlaceSignature words = index.signature(show(randomRows(1, 500)));
  EXPECT_LE(words.size() * sizeof(words[0]), 8000u);
  EXPECT_TRUE(std::is_sorted(words.begin(), words.end()));
}

TEST(PlaceIndex, ASignatureDependsOnTheRowsAlone) {
  const PlaceIndex one, other;
  Rows rows = randomRows(1, 50);
  const PlaceSignature words = one.signature(show(rows));
  std::reverse(rows.begin(), rows.end());
  EXPECT_EQ(other.signature(show(rows)), words) << "whatever their order, in whatever process";
}

TEST(PlaceIndex, RefusesWhatItCannotMakeWordsOf) {
  const PlaceIndex index;
  StereoFeatures floats = show(randomRows(1, 5));
  floats.element_type = ElementType::kFloat32;
  EXPECT_TRUE(contains(errorOf([&] { index.signature(floats); }), "float32"));
  StereoFeatures narrow = synthetic::noFeatures(synthetic::camera(), 0, 8);
  std::mt19937 random(1);
  synthetic::addFeature(narrow, 1.0, 1.0, 1.0, synthetic::randomRow(random, 8));
  EXPECT_TRUE(contains(errorOf([&] { index.signature(narrow); }), "at least 72 bits"));
  PlaceIndex twice;
  twice.add(1, {});
  EXPECT_TRUE(contains(errorOf([&] { twice.add(1, {}); }), "place 1"));
}

}  // namespace sdvo::test_place_index
