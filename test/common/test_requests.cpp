#include <gtest/gtest.h>

#include "../../src/common/worker.hpp"

namespace sdvo::test_requests {

TEST(Requests, HoldForWhatArrivesLaterAndOnce) {
  Requests<char> requests;
  const int queued = requests.posted();
  requests.post('a');
  const int later = requests.posted();
  EXPECT_FALSE(requests.take(queued)) << "it waited in the queue when the request came";
  EXPECT_EQ(requests.take(later), 'a');
  EXPECT_FALSE(requests.take(later));
}

TEST(Requests, TheNewestWins) {
  Requests<char> requests;
  requests.post('a');
  const int between = requests.posted();
  requests.post('b');
  EXPECT_FALSE(requests.take(between)) << "another one is to come before it matters";
  EXPECT_EQ(requests.take(requests.posted()), 'b');
}

}  // namespace sdvo::test_requests
