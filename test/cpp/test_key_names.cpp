// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "key_report.hpp"

namespace process_visualizer::displays {
namespace {

const std::set<std::string> kWanted = {"R", "M", "Space", "Shift+Space", "Left", "?", "+", "["};

TEST(KeyNames, AWantedKeyHasItsName) {
  EXPECT_EQ(wantedKey(Qt::Key_R, Qt::NoModifier, kWanted), "R");
  EXPECT_EQ(wantedKey(Qt::Key_Space, Qt::NoModifier, kWanted), "Space");
  EXPECT_EQ(wantedKey(Qt::Key_Space, Qt::ShiftModifier, kWanted), "Shift+Space");
  EXPECT_EQ(wantedKey(Qt::Key_Left, Qt::KeypadModifier, kWanted), "Left");
}

TEST(KeyNames, OthersAreRVizs) {
  EXPECT_EQ(wantedKey(Qt::Key_I, Qt::NoModifier, kWanted), "");
  EXPECT_EQ(wantedKey(Qt::Key_R, Qt::ShiftModifier, kWanted), "");
  EXPECT_EQ(wantedKey(Qt::Key_R, Qt::ControlModifier, kWanted), "");
  EXPECT_EQ(wantedKey(Qt::Key_M, Qt::AltModifier, kWanted), "");
  EXPECT_EQ(wantedKey(Qt::Key_R, Qt::NoModifier, {}), "");
}

TEST(KeyNames, ASignIsTheSameOnEveryKeyboard) {
  EXPECT_EQ(wantedKey(Qt::Key_Question, Qt::ShiftModifier, kWanted), "?");
  EXPECT_EQ(wantedKey(Qt::Key_Plus, Qt::ShiftModifier, kWanted), "+");
  EXPECT_EQ(wantedKey(Qt::Key_Plus, Qt::NoModifier, kWanted), "+");
  EXPECT_EQ(wantedKey(Qt::Key_BracketLeft, Qt::ControlModifier, kWanted), "");
}

TEST(KeyNames, OnlyStepsAreRepeated) {
  EXPECT_TRUE(repeats(Qt::Key_Left));
  EXPECT_TRUE(repeats(Qt::Key_BracketRight));
  EXPECT_FALSE(repeats(Qt::Key_R));
  EXPECT_FALSE(repeats(Qt::Key_Space));
}

TEST(KeyNames, AListKeepsTheKeysThatMoveWithinIt) {
  EXPECT_TRUE(movesWithin(Qt::Key_Left));
  EXPECT_TRUE(movesWithin(Qt::Key_PageDown));
  EXPECT_TRUE(movesWithin(Qt::Key_Plus));
  EXPECT_FALSE(movesWithin(Qt::Key_R));
  EXPECT_FALSE(movesWithin(Qt::Key_M));
  EXPECT_FALSE(movesWithin(Qt::Key_Space));
  EXPECT_FALSE(movesWithin(Qt::Key_Comma));
}

TEST(KeyNames, OneALine) {
  EXPECT_EQ(lines("R\nShift+Space\n\n,"), (std::set<std::string>{"R", "Shift+Space", ","}));
  EXPECT_TRUE(lines("").empty());
}

TEST(InputAge, CountsFromTheEventHandledSoonest) {
  InputAge age;
  EXPECT_DOUBLE_EQ(age.of(1'000, 501'200), 0.0);
  EXPECT_DOUBLE_EQ(age.of(2'000, 502'000), 0.0);
  EXPECT_DOUBLE_EQ(age.of(3'000, 510'000), 7.0);
  EXPECT_DOUBLE_EQ(age.of(0, 511'000), 0.0) << "an event without a time";
  EXPECT_DOUBLE_EQ(age.of(10'990, 511'000), 0.01);
}

TEST(InputAge, AClockThatStoodStillMakesNothingOld) {
  InputAge age;
  EXPECT_DOUBLE_EQ(age.of(1'000, 1'000), 0.0);
  EXPECT_DOUBLE_EQ(age.of(2'000, 3'602'000), 0.0) << "the X server's computer was suspended";
  EXPECT_DOUBLE_EQ(age.of(3'000, 3'604'000), 1.0);
}

TEST(InputAge, ClocksWrapAround) {
  InputAge age;
  EXPECT_DOUBLE_EQ(age.of(0xffffff00U, 1'000), 0.0);
  EXPECT_DOUBLE_EQ(age.of(0x00000100U, 1'512 + 300), 0.3);
  InputAge other;
  EXPECT_DOUBLE_EQ(other.of(5'000, 0xfffffff0U), 0.0);
  EXPECT_DOUBLE_EQ(other.of(5'100, 0xfffffff0U + 100 + 250), 0.25);
}

}  // namespace
}  // namespace process_visualizer::displays

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
