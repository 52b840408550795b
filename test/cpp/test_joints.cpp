// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "process_visualizer/common/complaint.hpp"
#include "process_visualizer/joints/joint_board.hpp"
#include "process_visualizer/joints/joint_message.hpp"
#include "process_visualizer/joints/measuring_time.hpp"

namespace process_visualizer::joints {
namespace {

using Names = std::vector<std::string>;
using Positions = std::vector<double>;

const Names kJoints = {"r/a", "r/b", "r/c"};
constexpr std::int64_t kMs = 1'000'000, kStart = 1'800'000'000'000 * kMs;  // ns

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
  EXPECT_THROW(matching.match({{"left_wheel", "right_wheel"}, {}}), ForeignJoints);  // velocities
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
  expectProblem({{"a"}, {}}, "no positions of a, only velocities or efforts");
}

TEST(JointMatching, OnlyAJointWithoutAUsablePositionIsLeftOut) {
  JointPositions found = JointMatching("r", kJoints).match({{}, {1.0, NAN, 3.0}});
  EXPECT_EQ(found.names, (Names{"r/a", "r/c"}));
  EXPECT_EQ(found.positions, (Positions{1.0, 3.0}));
  EXPECT_EQ(found.unusable, Names{"r/b"});
  found = JointMatching("r", kJoints).match({{"a", "gripper"}, {1.0, INFINITY}});
  EXPECT_EQ(found.names, Names{"r/a"});
  EXPECT_EQ(found.unusable, Names{"gripper"});
  found = JointMatching("r", kJoints).match({{}, {1.0, 1e30, -1e7}});
  EXPECT_EQ(found.unusable, (Names{"r/b", "r/c"}));
}

TEST(JointMatching, UnusablePositionsAreSaidOnceForAllJoints) {
  EXPECT_EQ(aboutUnusable({}), "");
  EXPECT_EQ(aboutUnusable({"a"}),
            "the position of a is NaN, infinite or beyond 1e6; that joint stays where it was");
  EXPECT_EQ(
      aboutUnusable({"a", "b"}),
      "the positions of a, b are NaN, infinite or beyond 1e6; those joints stay where they were");
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
  std::string deep = "<robot>";  // a parser may recurse for each nested element
  for (int i = 0; i < 200'000; ++i) deep += "<a>";
  EXPECT_THROW(movableJoints(deep), std::invalid_argument);
}

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;
using Time = JointBoard::Clock::time_point;

constexpr milliseconds kPeriod{33};
const Time kBegin{hours(1)};

TEST(JointBoard, EachGroupOfJointsIsPassedOnAtTheFullRate) {
  JointBoard board({"left", "right", "torso"}, kPeriod);
  std::map<std::string, Positions> passed;
  for (int i = 0; i < 100; ++i) {  // 100 Hz; the groups come directly after one another
    const Time now = kBegin + milliseconds(10 * i);
    for (const char* name : {"left", "right", "torso"}) {
      board.add({{name}, {static_cast<double>(i)}}, "/driver", now);
      const JointPositions found = board.due(now);
      for (std::size_t k = 0; k < found.names.size(); ++k)
        passed[found.names[k]].push_back(found.positions[k]);
    }
  }
  for (const auto& [name, positions] : passed) {
    EXPECT_GE(positions.size(), 24U) << name;
    EXPECT_LE(positions.size(), 32U) << name;
    for (std::size_t k = 1; k < positions.size(); ++k)
      EXPECT_LE(positions[k] - positions[k - 1], 5);
  }
  EXPECT_EQ(passed.size(), 3U);
}

TEST(JointBoard, NoGroupIsPassedOnLaterThanTheOthersOfItsCycle) {
  JointBoard board({"left", "right"}, kPeriod);
  for (int i = 0; i < 10; ++i) {
    const Time now = kBegin + milliseconds(40 * i);
    const double value = i;
    board.add({{"left"}, {value}}, "/driver", now);
    EXPECT_EQ(board.due(now).positions, Positions{value});
    board.add({{"right"}, {value}}, "/driver", now);
    EXPECT_EQ(board.due(now).positions, Positions{value});
  }
}

TEST(JointBoard, WhatHadToWaitIsPassedOnWhenNothingFollows) {
  JointBoard board({"a", "b"}, kPeriod);
  board.add({{"a", "b"}, {1.0, 2.0}}, "/driver", kBegin);
  EXPECT_EQ(board.due(kBegin).positions, (Positions{1.0, 2.0}));
  for (const char* name : {"a", "b"}) {
    board.add({{name}, {3.0}}, "/driver", kBegin + milliseconds(10));
    EXPECT_TRUE(board.due(kBegin + milliseconds(10)).names.empty());
  }
  EXPECT_EQ(board.rest(kBegin + milliseconds(60)).positions, (Positions{3.0, 3.0}));
  EXPECT_TRUE(board.rest(kBegin + milliseconds(120)).names.empty());
}

TEST(JointBoard, WhatOthersFollowedDirectlyIsPassedOnAgainWhenNothingFollows) {
  JointBoard board({"arm", "finger"}, kPeriod);
  board.add({{"finger"}, {0.5}}, "/gripper", kBegin);
  EXPECT_EQ(board.due(kBegin).names, Names{"finger"});
  board.add({{"arm"}, {1.0}}, "/driver", kBegin);
  EXPECT_EQ(board.due(kBegin).names, Names{"arm"});
  const JointPositions found = board.rest(kBegin + milliseconds(60));
  EXPECT_EQ(found.names, Names{"finger"});
  EXPECT_EQ(found.positions, Positions{0.5});
  EXPECT_TRUE(board.rest(kBegin + milliseconds(120)).names.empty());
}

TEST(JointBoard, AJointThatIsSentSeldomGoesWithTheOthers) {
  JointBoard board({"arm", "torso"}, kPeriod);
  board.add({{"torso"}, {0.5}}, "/driver", kBegin);
  board.due(kBegin);
  const Time later = kBegin + seconds(9);
  board.add({{"arm"}, {1.0}}, "/driver", later);
  const JointPositions found = board.due(later);
  EXPECT_EQ(found.names, (Names{"arm", "torso"}));
  EXPECT_EQ(found.positions, (Positions{1.0, 0.5}));
  EXPECT_TRUE(board.problems(later).empty());  // it may be sent on change only
}

std::string problem(const JointBoard& board, Time now) {
  const std::vector<std::string> found = board.problems(now);
  return found.empty() ? "" : found.front();
}

TEST(JointBoard, JointsThatNoMessageHas) {
  JointBoard board({"a", "b", "finger"}, kPeriod);
  EXPECT_EQ(problem(board, kBegin + hours(1)), "");  // nothing has come yet
  board.add({{"a", "b"}, {0.0, 0.0}}, "/driver", kBegin);
  EXPECT_EQ(problem(board, kBegin + seconds(2)), "");
  EXPECT_EQ(problem(board, kBegin + seconds(4)).find("no message has the position of finger"), 0U);
  board.add({{"finger"}, {0.0}}, "/gripper", kBegin + seconds(5));
  EXPECT_EQ(problem(board, kBegin + seconds(6)), "");
}

TEST(JointBoard, AGroupThatHasStoppedWhileOthersCome) {
  JointBoard board({"arm", "torso"}, kPeriod);
  const auto send = [&board](const std::string& name, int begin_ms, int end_ms) {
    for (int ms = begin_ms; ms < end_ms; ms += 10)
      board.add({{name}, {0.0}}, "/driver", kBegin + milliseconds(ms));
  };
  send("torso", 0, 1000);
  send("arm", 0, 4000);
  const std::string text = problem(board, kBegin + milliseconds(4000));
  EXPECT_EQ(text.find("no position of torso received for 3 s"), 0U) << text;
  send("torso", 4000, 4010);
  EXPECT_EQ(problem(board, kBegin + milliseconds(4020)), "");
}

TEST(JointBoard, TwoNodesThatContradictEachOtherAreNamed) {
  JointBoard board({"a", "b"}, kPeriod);
  Time now = kBegin;
  for (int i = 0; i < 20; ++i, now += milliseconds(10)) {
    board.add({{"a", "b"}, {1.2 + 0.001 * i, 0.0}}, "/driver", now);
    board.add({{"a", "b"}, {0.0, 0.0}}, "/joint_state_publisher", now);
  }
  const std::string text = problem(board, now);
  EXPECT_NE(text.find("2 nodes send positions of a that are up to 1.21"), std::string::npos)
      << text;
  EXPECT_NE(text.find("/driver (1.219), /joint_state_publisher (0.000)"), std::string::npos)
      << text;
  EXPECT_EQ(problem(board, now + seconds(3)), "");
}

TEST(JointBoard, ANodeThatPassesOnWhatAnotherSaysIsNoContradiction) {
  JointBoard board({"a"}, kPeriod);
  for (int i = 0; i < 500; ++i) {  // 2 rad/s; the second one is 0.1 s late
    const Time now = kBegin + milliseconds(10 * i);
    board.add({{"a"}, {0.02 * i}}, "/driver", now);
    board.add({{"a"}, {0.02 * std::max(0, i - 10)}}, "/relay", now);
    EXPECT_EQ(problem(board, now), "");
  }
}

std::vector<std::uint8_t> bytesOf(std::initializer_list<std::uint32_t> words) {
  std::vector<std::uint8_t> bytes;
  for (const std::uint32_t word : words)
    for (int shift = 0; shift < 32; shift += 8)
      bytes.push_back(static_cast<std::uint8_t>(word >> shift));
  return bytes;
}

constexpr char kArray[] = "std_msgs/Float32MultiArray";
constexpr char kState[] = "sensor_msgs/JointState";
constexpr char kDynamic[] = "control_msgs/DynamicJointState";

TEST(JointMessage, AnArrayAndAState) {
  EXPECT_EQ(decodeJoints(kArray, bytesOf({0, 1, 2, 0, 0x3f800000})).joints.positions,
            Positions{1.0});
  const StampedJoints state =
      decodeJoints(kState, bytesOf({7, 5, 6, 0, 1, 4, 0x64636261, 1, 0, 0x3ff00000, 0, 0}));
  EXPECT_EQ(state.joints.names, Names{"abcd"});
  EXPECT_EQ(state.joints.positions, Positions{1.0});
  EXPECT_EQ(state.stamp_ns, 5000000006U);
}

TEST(JointMessage, JointsWithInterfaces) {
  constexpr std::uint32_t kAbcd = 0x64636261, kEfgh = 0x68676665, kPosi = 0x69736f70,
                          kTion = 0x6e6f6974, kOne = 0x3ff00000, kTwo = 0x40000000;
  const StampedJoints found = decodeJoints(
      kDynamic, bytesOf({7,     5,     6, 0, 2,    4, kAbcd, 4, kEfgh, 2,     2, 4, kEfgh, 8,
                         kPosi, kTion, 2, 0, kTwo, 0, kOne,  1, 4,     kAbcd, 1, 0, kTwo}));
  EXPECT_EQ(found.stamp_ns, 5000000006U);
  EXPECT_EQ(found.joints.names, Names{"abcd"});  // the other one has no position
  EXPECT_EQ(found.joints.positions, Positions{1.0});
  const StampedJoints none =
      decodeJoints(kDynamic, bytesOf({7, 5, 6, 0, 1, 4, kAbcd, 1, 1, 4, kAbcd, 1, 0, kTwo}));
  EXPECT_EQ(none.joints.names, Names{"abcd"});
  EXPECT_TRUE(none.joints.positions.empty());
}

TEST(JointMessage, NothingIsAllocatedForALengthThatIsNotThere) {
  for (const std::uint32_t claimed : {0xffffffffU, 0x10000000U, 2U}) {
    EXPECT_THROW(decodeJoints(kArray, bytesOf({0, 0, claimed})), std::invalid_argument);
    EXPECT_THROW(decodeJoints(kArray, bytesOf({claimed, 0, 0})), std::invalid_argument);
    EXPECT_THROW(decodeJoints(kState, bytesOf({0, 0, 0, 0, claimed})), std::invalid_argument);
    EXPECT_THROW(decodeJoints(kState, bytesOf({0, 0, 0, claimed})), std::invalid_argument);
    EXPECT_THROW(decodeJoints(kState, bytesOf({0, 0, 0, 0, 0, 0, claimed, 0})),
                 std::invalid_argument);
    EXPECT_THROW(decodeJoints(kDynamic, bytesOf({0, 0, 0, 0, claimed})), std::invalid_argument);
    EXPECT_THROW(decodeJoints(kDynamic, bytesOf({0, 0, 0, 0, 0, claimed})), std::invalid_argument);
    EXPECT_THROW(decodeJoints(kDynamic, bytesOf({0, 0, 0, 0, 1, 0, 1, claimed})),
                 std::invalid_argument);
  }
  EXPECT_THROW(decodeJoints("std_msgs/String", {}), std::invalid_argument);
}

// Mostly stamps, and arrivals for those in the future, would make a steady robot jerk.
TEST(MeasuringTime, StampsOfAClockThatIsAheadStayEven) {
  MeasuringTime time;
  std::int64_t before = 0;
  for (int message = 0; message < 4000; ++message) {
    const std::int64_t sent = kStart + message * 8 * kMs;
    const std::int64_t arrival = sent + message * 7 % 6 * kMs;  // up to 5 ms on the way
    const std::int64_t measured = time.of(sent + 3 * kMs, arrival);
    EXPECT_LE(measured, arrival);
    if (message > 6) {
      EXPECT_EQ(measured - before, 8 * kMs);
    }
    before = measured;
  }
}

TEST(MeasuringTime, StampsOfThePastAreKept) {
  MeasuringTime time;
  EXPECT_EQ(time.of(kStart - 200 * kMs, kStart), kStart - 200 * kMs);
  EXPECT_EQ(time.of(kStart - 1001 * kMs, kStart), kStart);  // another computer's clock
  EXPECT_EQ(time.of(kStart + 1001 * kMs, kStart), kStart);
  EXPECT_EQ(time.of(0, kStart), kStart);
}

TEST(MeasuringTime, AClockThatIsSetRightIsFollowed) {
  MeasuringTime time;
  EXPECT_EQ(time.of(kStart + 300 * kMs, kStart), kStart);
  std::int64_t arrival = kStart;
  for (int second = 1; second < 25; ++second) {
    arrival += 1000 * kMs;
    time.of(arrival - 2 * kMs, arrival);
  }
  EXPECT_EQ(time.of(arrival + 98 * kMs, arrival + 100 * kMs), arrival + 98 * kMs);
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
  EXPECT_NE(still.find("is not advancing"), std::string::npos) << still;
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
