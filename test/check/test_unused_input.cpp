#include <gtest/gtest.h>

#include "../../src/check/unused_input.hpp"
#include "../said.hpp"

namespace sdvo::test_unused_input {

/// The fault; empty: none.
std::string fault(UnusedInput& unused) {
  Values values;
  const Findings findings = unused.judge({Verdict::kOk, "well"}, values);
  EXPECT_LE(findings.size(), 2u);
  EXPECT_EQ(findings.front().what, "well");
  return findings.size() < 2 ? "" : findings.back().text();
}

TEST(UnusedInput, WarnsOfWhatIsMuchAndOfWhatIsRare) {
  UnusedInput unused("pairs", 0.05);
  fault(unused);
  for (int i = 0; i < 100; ++i) unused.noteUsed();
  for (int i = 0; i < 2; ++i) unused.add(UnusedInput::kUnpaired);
  EXPECT_EQ(fault(unused), "") << "an accident";
  for (int i = 0; i < 8; ++i) unused.add(UnusedInput::kUnpaired);
  EXPECT_EQ(fault(unused), "10 of 110 pairs unpaired");
  for (int i = 0; i < 6; ++i) fault(unused);
  EXPECT_EQ(fault(unused), "") << "long ago";

  unused.add(UnusedInput::kLate);
  expectWords(fault(unused), {"1 pairs late", "driver's stamps"});
  EXPECT_EQ(fault(unused), "");
  EXPECT_EQ(unused.sum(), 11u);
}

TEST(UnusedInput, MissingGuessesAreAShareOfWhatIsUsed) {
  UnusedInput unused("feature messages", 0.05);
  fault(unused);
  for (int i = 0; i < 20; ++i) {
    unused.noteUsed();
    if (i % 2 == 0) unused.add(UnusedInput::kNoGuess);
  }
  expectWords(fault(unused), {"10 of 20 feature messages", "guess_timeout"});
  EXPECT_EQ(unused.sum(), 0u);
}

TEST(UnusedInput, CausesThatOtherTasksExplainAreOnlyCounted) {
  UnusedInput unused("pairs", 0.05, {UnusedInput::kPushedOut});
  fault(unused);
  for (int i = 0; i < 20; ++i) unused.add(UnusedInput::kPushedOut);
  EXPECT_EQ(fault(unused), "");
  EXPECT_EQ(unused.count(UnusedInput::kPushedOut), 20u);
}

}  // namespace sdvo::test_unused_input
