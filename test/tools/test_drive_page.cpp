#include <gtest/gtest.h>

#include "../../src/tools/drive_page.hpp"

namespace sdvo {
namespace test_drive_page {

TEST(WorstOfEach, APairWithoutAPoseIsNeverLeftOut) {
  const auto shown = [](const std::string& states, std::size_t step) {
    std::vector<OfflineRun::Frame> frames(states.size());
    for (std::size_t i = 0; i < states.size(); ++i)
      frames[i].odometry.state = static_cast<TrackingState>(std::string("WTDL").find(states[i]));
    return worstOfEach(frames, step);
  };
  EXPECT_EQ(shown("WTTDT", 1), (std::vector<std::size_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(shown("TTTTTTT", 3), (std::vector<std::size_t>{0, 3, 6}));
  EXPECT_EQ(shown("TDLTTWTD", 3), (std::vector<std::size_t>{2, 5, 7}));
}

}  // namespace test_drive_page
}  // namespace sdvo
