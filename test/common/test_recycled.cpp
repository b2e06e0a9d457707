#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "stereo_descriptor_vo/common/recycled.hpp"

namespace sdvo::test_recycled {

using Lists = Recycled<std::vector<int>>;

Lists listsOf(const std::vector<std::vector<int>>& contents) {
  Lists lists;
  for (const auto& content : contents) lists.add() = content;
  return lists;
}

std::vector<std::vector<int>> contentsOf(const Lists& lists) {
  return {lists.begin(), lists.end()};
}

const auto is_short = [](const std::vector<int>& list) { return list.size() < 2; };

TEST(Recycled, TheOthersCloseUpInTheirOrder) {
  Lists lists = listsOf({{1, 2}, {3}, {4, 5}, {6}, {7, 8}});
  lists.removeIf(is_short);
  EXPECT_EQ(contentsOf(lists), (std::vector<std::vector<int>>{{1, 2}, {4, 5}, {7, 8}}));
}

TEST(Recycled, ANewElementTakesTheMemoryOfOneThatWent) {
  Lists lists = listsOf({{1, 2}, {3}});
  const int* memory = lists[1].data();
  lists.removeIf(is_short);
  EXPECT_EQ(lists.add().data(), memory);
}

TEST(Recycled, ACopyUsesTheMemoryThatItHas) {
  const Lists few = listsOf({{10, 11}}), many = listsOf({{1, 2}, {3, 4}, {5, 6}});
  Lists copy = many;
  const int* memory[] = {copy[0].data(), copy[1].data(), copy[2].data()};
  copy = few;
  EXPECT_EQ(contentsOf(copy), contentsOf(few));
  copy = many;
  EXPECT_EQ(contentsOf(copy), contentsOf(many));
  const std::vector<const int*> now = {copy[0].data(), copy[1].data(), copy[2].data()};
  for (const int* each : memory) EXPECT_EQ(std::count(now.begin(), now.end(), each), 1);
}

TEST(Recycled, ACopyLeavesTheMemoryOfThoseThatWent) {
  Lists lists = listsOf({{1, 2}, {3}});
  lists.removeIf(is_short);
  Lists copy = lists;
  EXPECT_EQ(contentsOf(copy), contentsOf(lists));
  EXPECT_EQ(copy.add().capacity(), 0u);
}

}  // namespace sdvo::test_recycled
