#include <gtest/gtest.h>

#include "../../src/ros/diagnostics/diagnostic_tasks.hpp"

namespace sdvo::test_unused_input {

using Status = WallUpdater::Status;
using Level = WallUpdater::Level;

Status diagnose(UnusedInput& unused) {
  Status status;
  WallUpdater::print(unused.judge({Verdict::kOk, "well"}, status), status);
  return status;
}

TEST(UnusedInput, WarnsOfWhatIsMuchAndOfWhatIsRare) {
  UnusedInput unused("pairs", 0.05);
  diagnose(unused);
  for (int i = 0; i < 100; ++i) unused.noteUsed();
  for (int i = 0; i < 2; ++i) unused.add(UnusedInput::kUnpaired);
  EXPECT_EQ(diagnose(unused).level, Level::OK) << "an accident";
  for (int i = 0; i < 8; ++i) unused.add(UnusedInput::kUnpaired);
  const Status much = diagnose(unused);
  EXPECT_EQ(much.level, Level::WARN);
  EXPECT_EQ(much.message, "10 of 110 pairs unpaired");
  for (int i = 0; i < 6; ++i) diagnose(unused);
  EXPECT_EQ(diagnose(unused).level, Level::OK) << "long ago";

  unused.add(UnusedInput::kLate);
  EXPECT_EQ(diagnose(unused).message, "1 pairs late or with wrong stamps: check the driver's stamps");
  EXPECT_EQ(diagnose(unused).level, Level::OK);
  EXPECT_EQ(unused.sum(), 11u);
}

TEST(UnusedInput, MissingGuessesAreAShareOfWhatIsUsed) {
  UnusedInput unused("feature messages", 0.05);
  diagnose(unused);
  for (int i = 0; i < 20; ++i) {
    unused.noteUsed();
    if (i % 2 == 0) unused.add(UnusedInput::kNoGuess);
  }
  EXPECT_EQ(diagnose(unused).message,
            "10 of 20 feature messages without a guess of the motion: guess_timeout, or the source of the guess");
  EXPECT_EQ(unused.sum(), 0u);
}

TEST(UnusedInput, CausesThatOtherTasksExplainAreOnlyCounted) {
  UnusedInput unused("pairs", 0.05, {UnusedInput::kPushedOut});
  diagnose(unused);
  for (int i = 0; i < 20; ++i) unused.add(UnusedInput::kPushedOut);
  EXPECT_EQ(diagnose(unused).level, Level::OK);
  EXPECT_EQ(unused.count(UnusedInput::kPushedOut), 20u);
}

}  // namespace sdvo::test_unused_input
