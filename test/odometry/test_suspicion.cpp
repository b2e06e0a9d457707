#include <gtest/gtest.h>

#include "stereo_descriptor_vo/odometry/suspicion.hpp"

namespace sdvo {
namespace test_suspicion {

/// Pairs that are suspected, this one included.
int lasting(Suspicion suspicion) {
  int pairs = 0;
  for (; suspicion.isRaised(); suspicion.pass()) ++pairs;
  return pairs;
}

TEST(Suspicion, IsOfThisPairAndOfSoManyAfterIt) {
  Suspicion suspicion;
  EXPECT_FALSE(suspicion.isRaised());
  suspicion.pass();
  EXPECT_EQ(lasting(suspicion), 0);
  suspicion.raise("a mover");
  EXPECT_EQ(lasting(suspicion), 1 + Suspicion::kShort);
}

TEST(Suspicion, AShorterOneDoesNotEndALongerOne) {
  Suspicion suspicion;
  suspicion.raise("no motion", Suspicion::kLong);
  suspicion.pass();
  suspicion.raise("a mover");
  EXPECT_EQ(suspicion.cause(), "no motion");
  EXPECT_EQ(lasting(suspicion), Suspicion::kLong);
}

TEST(Suspicion, NamesTheFirstCauseThatLasts) {
  Suspicion suspicion;
  suspicion.raise("the rig");
  suspicion.pass();
  suspicion.raise("a mover");
  EXPECT_EQ(suspicion.cause(), "the rig");
  EXPECT_EQ(lasting(suspicion), 1 + Suspicion::kShort);
  while (suspicion.isRaised()) suspicion.pass();
  suspicion.raise("a mover");
  EXPECT_EQ(suspicion.cause(), "a mover");
}

}  // namespace test_suspicion
}  // namespace sdvo
