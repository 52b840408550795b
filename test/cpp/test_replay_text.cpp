// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "replay_text.hpp"

namespace process_visualizer::displays {
namespace {

constexpr double kNow_s = 1.7e9;

/// A player that plays the moment `ago_s` before now.
PlayedState playing(double ago_s, double rate = 1) {
  PlayedState state;
  state.stamp_s = state.received_s = kNow_s;
  state.begin_s = kNow_s - 60;
  state.position_s = 60 - ago_s;
  state.rate = rate;
  return state;
}

PlayedState paused(double ago_s) {
  PlayedState state = playing(ago_s);
  state.is_paused = true;
  return state;
}

std::string textOf(const PlayedState& state, double later_s = 0) {
  return ReplayText().at(state, kNow_s + later_s);
}

TEST(ReplayText, HowLongAgo) {
  EXPECT_EQ(textOf(playing(12.3)), "12.3 s ago");
  EXPECT_EQ(textOf(playing(0)), "\u20070.0 s ago");
  EXPECT_EQ(textOf(playing(9.94)), "\u20079.9 s ago");
  EXPECT_EQ(textOf(playing(9.96)), "10.0 s ago");
}

TEST(ReplayText, LongAgo) {
  EXPECT_EQ(textOf(playing(59.9)), "59.9 s ago");
  EXPECT_EQ(textOf(playing(59.97)), "1 min \u20070.0 s ago");
  EXPECT_EQ(textOf(playing(83.4)), "1 min 23.4 s ago");
  EXPECT_EQ(textOf(playing(3 * 3600 + 12 * 60 + 7)), "3 h 12 min ago");
}

TEST(ReplayText, WhatIsToComeIsNow) { EXPECT_EQ(textOf(playing(-5)), "\u20070.0 s ago"); }

TEST(ReplayText, HowItIsPlayed) {
  EXPECT_EQ(textOf(paused(12.3)), "12.3 s ago   paused");
  EXPECT_EQ(textOf(playing(12.3, 0.5)), "12.3 s ago   \u00d70.5");
  EXPECT_EQ(textOf(playing(12.3, 2)), "12.3 s ago   \u00d72");
  EXPECT_EQ(textOf(playing(12.3, -1)), "12.3 s ago   \u00d7\u22121");
}

TEST(ReplayText, WithoutAPlayer) {
  EXPECT_EQ(ReplayText().at(std::nullopt, kNow_s), "preparing\u2026");
  EXPECT_EQ(textOf(playing(12.3), 1.9), "12.3 s ago");
  EXPECT_EQ(textOf(playing(12.3), 2.1), "player is not responding");
}

TEST(ReplayText, TimeGoesOnBetweenStates) {
  EXPECT_NEAR(agoAt(playing(12), kNow_s + 0.5), 12, 1e-6);
  EXPECT_NEAR(agoAt(paused(12), kNow_s + 0.5), 12.5, 1e-6);
  EXPECT_NEAR(agoAt(playing(12, 0.5), kNow_s + 0.5), 12.25, 1e-6);
  EXPECT_NEAR(agoAt(playing(12, -1), kNow_s + 0.5), 13, 1e-6);
}

TEST(ReplayText, PlayingBeginsAMomentLater) {
  PlayedState state = playing(12);
  state.since_s = kNow_s + 0.2;
  EXPECT_NEAR(agoAt(state, kNow_s + 0.1), 12.1, 1e-6);
  EXPECT_NEAR(agoAt(state, kNow_s + 1), 12.2, 1e-6);
}

TEST(ReplayText, NothingIsPlayedPastTheEnds) {
  PlayedState state = playing(12, 4);
  state.duration_s = 50;
  EXPECT_NEAR(agoAt(state, kNow_s + 1), 11, 1e-6);
  state.rate = -100;
  EXPECT_NEAR(agoAt(state, kNow_s + 1), 61, 1e-6);
}

TEST(ReplayText, DoesNotFlickerBetweenTenths) {
  ReplayText text;
  std::set<std::string> texts;
  for (int i = 0; i < 100; ++i) texts.insert(text.at(playing(12.35 + 0.02 * std::sin(i)), kNow_s));
  EXPECT_EQ(texts.size(), 1U);
}

TEST(ReplayText, PausedItCountsEveryTenth) {
  ReplayText text;
  std::set<std::string> texts;
  for (int i = 0; i < 40; ++i) texts.insert(text.at(paused(12), kNow_s + 0.025 * i));
  EXPECT_GE(texts.size(), 10U);
}

TEST(ReplayText, WhateverComes) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double value : {nan, 1e300, -1e300, std::numeric_limits<double>::infinity()}) {
    PlayedState state = playing(12);
    state.position_s = value;
    state.rate = value;
    EXPECT_FALSE(textOf(state, 1).empty());
  }
}

}  // namespace
}  // namespace process_visualizer::displays

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
