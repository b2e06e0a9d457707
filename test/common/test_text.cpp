#include <gtest/gtest.h>

#include "../../src/common/text.hpp"

namespace sdvo::test_text {

TEST(Text, AWildNumberHasFewDigits) {
  EXPECT_EQ(text(1, 640, "x", 480, ", f ", 400.0, " px"), "640x480, f 400.0 px");
  EXPECT_EQ(text(1, "f ", 1e300, " px, ", -2.5), "f 1.0e+300 px, -2.5");
  EXPECT_EQ(text(3, 1795739520.5), "1795739520.500") << "a stamp is not wild";
}

}  // namespace sdvo::test_text
