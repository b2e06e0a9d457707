#include <gtest/gtest.h>

#include "../../src/common/text.hpp"
#include "../comma_locale.hpp"

namespace sdvo::test_text {

TEST(Text, AWildNumberHasFewDigits) {
  EXPECT_EQ(text(1, 640, "x", 480, ", f ", 400.0, " px"), "640x480, f 400.0 px");
  EXPECT_EQ(text(1, "f ", 1e300, " px, ", -2.5), "f 1.0e+300 px, -2.5");
  EXPECT_EQ(text(3, 1795739520.5), "1795739520.500") << "a stamp is not wild";
}

TEST(Text, HasNoLocale) {
  const CommaLocale set;
  EXPECT_EQ(text(1, 1234.5, " of ", 5678), "1234.5 of 5678");
}

}  // namespace sdvo::test_text
