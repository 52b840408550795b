// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "process_visualizer/common/complaint.hpp"
#include "process_visualizer/joints/joint_coverage.hpp"
#include "process_visualizer/joints/joint_matching.hpp"
#include "process_visualizer/joints/time_watch.hpp"

namespace process_visualizer::joints {
namespace {

using Names = std::vector<std::string>;
using Positions = std::vector<double>;

const Names kJoints = {"r/a", "r/b", "r/c"};

void expectProblem(const JointPositions& measured, const std::string& problem) {
  try {
    JointMatching("r", kJoints).match(measured);
    FAIL() << "no problem, but expected: " << problem;
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(problem), std::string::npos) << error.what();
  }
}

TEST(JointMatching, PositionsWithoutNamesAreInOrder) {
  const JointPositions found = JointMatching("r", kJoints).match({{}, {1.0, 2.0, 3.0}});
  EXPECT_EQ(found.names, kJoints);
  EXPECT_EQ(found.positions, (Positions{1.0, 2.0, 3.0}));
}

TEST(JointMatching, NamesMatchWithAndWithoutTheRobotsName) {
  const JointPositions found =
      JointMatching("r", kJoints).match({{"a", "gripper", "r/b"}, {1.0, 2.0, 3.0}});
  EXPECT_EQ(found.names, (Names{"r/a", "r/b"}));
  EXPECT_EQ(found.positions, (Positions{1.0, 3.0}));
}

TEST(JointMatching, NamesMatchWithAndWithoutAPrefix) {
  const JointPositions found =
      JointMatching("left", {"a", "b"}, {}, "l_").match({{"l_a", "r_a", "b"}, {1.0, 2.0, 3.0}});
  EXPECT_EQ(found.names, (Names{"a", "b"}));
  EXPECT_EQ(found.positions, (Positions{1.0, 3.0}));
}

TEST(JointMatching, JointsOfAnotherRobotAreTold) {
  const JointMatching matching("r", kJoints);
  EXPECT_THROW(matching.match({{"x"}, {1.0}}), ForeignJoints);
  try {
    matching.match({{"a", "b"}, {1.0}});
    FAIL() << "two names with one position fit";
  } catch (const ForeignJoints&) {
    FAIL() << "the joints are those of the robot";
  } catch (const std::invalid_argument&) {
  }
}

TEST(JointMatching, WhatDoesNotFitSaysWhy) {
  expectProblem({{}, {1.0, 2.0}},
                "3 values are expected, one for each joint of r/a, r/b, r/c, not 2");
  expectProblem({{}, {}}, "3 values are expected");
  expectProblem({{"r/a"}, {1.0, 2.0}}, "1 joint names come with 2 positions");
  expectProblem({{"x"}, {1.0}}, "none of the names x is a joint");
  expectProblem({{}, {1.0, NAN, 3.0}}, "NaN or infinity");
  expectProblem({{"a"}, {INFINITY}}, "NaN or infinity");
}

TEST(JointMatching, OffsetsAreAddedByEitherName) {
  const JointMatching matching("r", kJoints, {{"a", 0.5}, {"r/c", -1.0}});
  EXPECT_EQ(matching.match({{}, {1.0, 2.0, 3.0}}).positions, (Positions{1.5, 2.0, 2.0}));
  EXPECT_EQ(matching.match({{"r/a", "c"}, {1.0, 3.0}}).positions, (Positions{1.5, 2.0}));
  EXPECT_THROW(JointMatching("r", kJoints, {{"x", 1.0}}), std::invalid_argument);
  EXPECT_THROW(JointMatching("r", kJoints, {{"a", NAN}}), std::invalid_argument);
}

TEST(MovableJoints, AreThoseThatAreMeasuredInTheOrderOfTheFile) {
  const Names found = movableJoints(
      "<?xml version='1.0'?><!-- x --><robot name='r'><link name='l'/>"
      "<joint name='z' type='revolute'/><joint name='f' type='fixed'/>"
      "<joint name='m' type='revolute'><mimic joint='z'/></joint>"
      "<joint name='p' type='prismatic'/><joint name='c' type='continuous'/></robot>");
  EXPECT_EQ(found, (Names{"z", "p", "c"}));
}

TEST(MovableJoints, OfWhatIsNoUrdf) {
  EXPECT_THROW(movableJoints("<robot>"), std::invalid_argument);
  EXPECT_THROW(movableJoints("<cell/>"), std::invalid_argument);
  EXPECT_THROW(movableJoints(""), std::invalid_argument);
}

TEST(JointCoverage, JointsThatNoMessageTellsAbout) {
  JointCoverage coverage({"a", "b", "finger"});
  const JointCoverage::Clock::time_point begin;
  EXPECT_EQ(coverage.problem(begin + std::chrono::hours(1)), "");  // nothing has come yet
  coverage.add({"a", "b"}, begin);
  EXPECT_EQ(coverage.problem(begin + std::chrono::seconds(2)), "");
  EXPECT_EQ(coverage.problem(begin + std::chrono::seconds(4)).find("none says where finger is"),
            0U);
  coverage.add({"finger"}, begin + std::chrono::seconds(5));
  EXPECT_EQ(coverage.problem(begin + std::chrono::seconds(6)), "");
}

TEST(TimeWatch, TimeThatGoesOnIsRight) {
  TimeWatch watch;
  const TimeWatch::Clock::time_point begin;
  EXPECT_EQ(watch.problem(0.0, begin), "");
  EXPECT_EQ(watch.problem(0.0, begin + std::chrono::milliseconds(900)), "");  // a coarse clock
  EXPECT_EQ(watch.problem(0.5, begin + std::chrono::milliseconds(1500)), "");
  EXPECT_EQ(watch.problem(0.5, begin + std::chrono::milliseconds(2400)), "");
}

TEST(TimeWatch, TimeThatStandsStillOrGoesBackIsNamed) {
  TimeWatch watch;
  const TimeWatch::Clock::time_point begin;
  EXPECT_EQ(watch.problem(7.0, begin), "");
  const std::string still = watch.problem(7.0, begin + std::chrono::milliseconds(1100));
  EXPECT_NE(still.find("stands still"), std::string::npos) << still;
  const std::string back = watch.problem(6.9, begin + std::chrono::milliseconds(1200));
  EXPECT_NE(back.find("gone back"), std::string::npos) << back;
  EXPECT_EQ(watch.problem(7.0, begin + std::chrono::seconds(5)), back);  // it may not be said yet
  EXPECT_EQ(watch.problem(8.0, begin + std::chrono::seconds(8)), "");
}

TEST(Complaint, StandsUntilGoodMessagesComeForSomeTime) {
  Complaint complaint;
  Complaint::Time now;
  EXPECT_FALSE(complaint.holds(now));
  complaint.add("first", now);
  complaint.add("second", now += std::chrono::seconds(1));
  EXPECT_EQ(complaint.count(), 2U);
  EXPECT_EQ(complaint.text(), "second");
  EXPECT_TRUE(complaint.holds(now + std::chrono::hours(1)));  // the last message was a bad one
  complaint.noteGood();
  EXPECT_TRUE(complaint.holds(now + std::chrono::seconds(2)));
  EXPECT_FALSE(complaint.holds(now + std::chrono::seconds(4)));
  complaint.add("third", now + std::chrono::seconds(3));
  EXPECT_TRUE(complaint.holds(now + std::chrono::seconds(9)));
}

}  // namespace
}  // namespace process_visualizer::joints

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
