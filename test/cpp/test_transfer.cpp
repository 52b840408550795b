// SPDX-License-Identifier: BSD-3-Clause
// Order and time in which the parts of packets are written.

#include <gtest/gtest.h>

#include "process_visualizer/sender/subscriber_link.hpp"

namespace process_visualizer::sender {

namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(Transfer, ASmallPacketIsWrittenWhenItIsDue) {
  const Transfer transfer(1000, 5 * kMs);
  EXPECT_EQ(transfer.begin(), 5 * kMs);
  EXPECT_EQ(transfer.sizeOf(0, 5 * kMs), 1000U);
}

TEST(Transfer, ALargePacketIsWrittenInSlicesAndItsLastByteWhenItIsDue) {
  for (const std::size_t size : {40'000U, 1'000'000U, 50'000'000U}) {
    const Transfer transfer(size, 1000 * kMs);
    std::size_t written = 0;
    std::int64_t last_ns = 0;
    EXPECT_GE(transfer.begin(), 992 * kMs);
    while (written < size - 1) {
      const std::int64_t now_ns = transfer.timeOf(written);
      EXPECT_GT(now_ns, last_ns);
      EXPECT_LT(now_ns, 1000 * kMs);
      last_ns = now_ns;
      written += transfer.sizeOf(written, now_ns);
    }
    ASSERT_EQ(written, size - 1);
    EXPECT_EQ(transfer.timeOf(written), 1000 * kMs);
    EXPECT_EQ(transfer.sizeOf(written, 1000 * kMs), 1U);
  }
}

TEST(Transfer, WhatIsOverdueIsWrittenAtOnce) {
  EXPECT_EQ(Transfer(1'000'000, 5).sizeOf(300'000, 6), 700'000U);
}

}  // namespace

}  // namespace process_visualizer::sender

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
