#include "render/bounded_buffer.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <thread>
#include <vector>

namespace medulla {
namespace {

// Empties until there is nothing more, and fails at `bad`.
std::vector<int> emptied(BoundedBuffer<std::vector<int>>& buffer, int bad = -1) {
  std::vector<int> seen;
  try {
    while (auto thing = buffer.next()) {
      if (thing->at(0) == bad) throw std::runtime_error("bad");
      seen.push_back(thing->at(0));
      buffer.giveBack(std::move(*thing));
    }
  } catch (...) {
    buffer.fail(std::current_exception());
  }
  return seen;
}

void fill(BoundedBuffer<std::vector<int>>& buffer, int count) {
  for (int k = 0; k < count; ++k) {
    std::vector<int> thing = buffer.take();
    thing.assign(100, k);
    buffer.give(std::move(thing));
  }
}

TEST(BoundedBuffer, HandsOverAllInOrder) {
  BoundedBuffer<std::vector<int>> buffer(3);
  std::vector<int> seen;
  std::thread other([&] { seen = emptied(buffer); });
  fill(buffer, 1000);
  buffer.end();
  other.join();
  buffer.rethrow();
  ASSERT_EQ(seen.size(), 1000U);
  for (int k = 0; k < 1000; ++k) EXPECT_EQ(seen[std::size_t(k)], k);
}

TEST(BoundedBuffer, UsesMemoryAgain) {
  BoundedBuffer<std::vector<int>> buffer(1);
  fill(buffer, 1);
  std::vector<int> thing = *buffer.next();
  const int* const memory = thing.data();
  buffer.giveBack(std::move(thing));
  EXPECT_EQ(buffer.take().data(), memory);
}

// Who fills would otherwise wait for ever for something to fill.
TEST(BoundedBuffer, AFailureReachesWhoFills) {
  BoundedBuffer<std::vector<int>> buffer(2);
  std::vector<int> seen;
  std::thread other([&] { seen = emptied(buffer, 5); });
  EXPECT_THROW(fill(buffer, 1000), std::runtime_error);
  buffer.abandon();
  other.join();
  EXPECT_EQ(seen, (std::vector<int>{0, 1, 2, 3, 4}));
  EXPECT_THROW(buffer.rethrow(), std::runtime_error);
}

TEST(BoundedBuffer, WhatWaitsIsDroppedWhereItIsAbandoned) {
  BoundedBuffer<std::vector<int>> buffer(3);
  fill(buffer, 2);
  EXPECT_FALSE(buffer.abandoned());
  buffer.abandon();
  EXPECT_TRUE(buffer.abandoned());
  EXPECT_FALSE(buffer.next());
}

TEST(BoundedBuffer, WhatWaitsIsEmptiedAfterItsEnd) {
  BoundedBuffer<std::vector<int>> buffer(3);
  fill(buffer, 2);
  buffer.end();
  EXPECT_EQ(emptied(buffer), (std::vector<int>{0, 1}));
}

}  // namespace
}  // namespace medulla
