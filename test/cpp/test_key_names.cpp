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

}  // namespace
}  // namespace process_visualizer::displays

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
