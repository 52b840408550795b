// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "process_visualizer/recorder/machine.hpp"
#include "process_visualizer/recorder/message.hpp"
#include "process_visualizer/recorder/topic_statistics.hpp"
#include "recorder_machine.hpp"
#include "recorder_messages.hpp"

namespace process_visualizer::recorder {
namespace {

TEST(Clock, JumpsAreNotedAndDriftIsNot) {
  SimulatedMachine machine;
  ClockWatch watch(machine.machine());
  for (const double step : {0.0, 0.05, -0.05, -900.0, 0.0, 0.2}) {
    machine.goOn(1);
    machine.jump(step);
    watch.look();
  }
  ASSERT_EQ(watch.jumps().size(), 2u);
  EXPECT_NEAR(watch.jumps()[0].seconds, -900, 1e-6);
  EXPECT_NEAR(watch.jumps()[0].time, 1004 - 900, 1e-6);
  EXPECT_NEAR(watch.jumps()[1].seconds, 0.2, 1e-6);
}

TEST(Clock, ASimulatedOneMayStandStillAndRunFastButNotJump) {
  SimulatedMachine machine;
  machine.simulate(0);
  ClockWatch watch(machine.machine());
  double time = 0;
  for (const double step : {100.0, 0.5, 0.0, 5.0, 3600.0, 0.5, -3600.0, -0.2, 0.5}) {
    machine.goOn(0.5);
    machine.simulate(time += step);  // the first message on /clock is no jump
    watch.look();
  }
  ASSERT_EQ(watch.jumps().size(), 3u);
  EXPECT_NEAR(watch.jumps()[0].seconds, 3599.5, 1e-6);
  EXPECT_NEAR(watch.jumps()[0].time, 3705.5, 1e-6);
  EXPECT_NEAR(watch.jumps()[1].seconds, -3600.5, 1e-6);
  EXPECT_NEAR(watch.jumps()[2].seconds, -0.7, 1e-6);
}

TEST(Names, AreListedAsFarAsSomebodyReads) {
  EXPECT_EQ(listed({"/a", "/b"}), "/a, /b");
  EXPECT_EQ(listed(std::vector<std::string>(500, "/a")), "/a, /a, /a, /a, /a and 495 more");
}

TEST(Statistics, CountSequenceNumbersLeftOut) {
  TopicStatistics statistics;
  const auto connection = connectionWith("# comment\nuint8 A=1\n\nHeader header\n");
  for (const std::uint32_t sequence : {7u, 8u, 11u, 12u, 3u, 4u})
    statistics.add(messageAt(1, connection, 10, sequence));
  EXPECT_EQ(statistics.lost(), 2u);
  EXPECT_EQ(statistics.gaps(), 1u);
}

TEST(Statistics, FindLongIntervalsWhereThereAreNoNumbers) {
  TopicStatistics statistics;
  const auto connection = connectionWith("float32 data");
  for (int i = 0; i < 20; ++i) statistics.add(messageAt(1 + 0.01 * i, connection));
  EXPECT_EQ(statistics.gaps(), 0u);
  statistics.add(messageAt(1.25, connection));
  EXPECT_EQ(statistics.gaps(), 1u);
  EXPECT_EQ(statistics.lost(), 0u);
  EXPECT_NEAR(statistics.largestGap(), 0.06, 1e-6);
  EXPECT_NEAR(statistics.largestGapTime().toSec(), 1.19, 1e-6);
}

TEST(Statistics, TellASilenceOnce) {
  TopicStatistics statistics;
  const auto connection = connectionWith("float32 data");
  EXPECT_FALSE(statistics.fellSilent(ros::Time(100)));
  for (int i = 0; i <= 10; ++i) statistics.add(messageAt(1 + 0.2 * i, connection));
  EXPECT_FALSE(statistics.fellSilent(ros::Time(4.9)));
  EXPECT_TRUE(statistics.fellSilent(ros::Time(5.1)));
  EXPECT_FALSE(statistics.fellSilent(ros::Time(6)));
  for (int i = 0; i <= 31; ++i) statistics.add(messageAt(7 + 0.2 * i, connection));
  EXPECT_TRUE(statistics.fellSilent(ros::Time(16)));
}

TEST(Statistics, KnowThatWhatIsSentOnChangePauses) {
  TopicStatistics statistics;
  const auto connection = connectionWith("bool data");
  for (int burst = 0; burst < 3; ++burst)
    for (int i = 0; i < 5; ++i) statistics.add(messageAt(1 + 5 * burst + 0.1 * i, connection));
  EXPECT_FALSE(statistics.fellSilent(ros::Time(20.5)));
  EXPECT_TRUE(statistics.fellSilent(ros::Time(21)));
}

TEST(Statistics, NeverCallALogOrALatchedTopicSilent) {
  using Fields = std::map<std::string, std::string>;
  for (const Fields& fields : {Fields{{"type", "rosgraph_msgs/Log"}}, Fields{{"latching", "1"}}}) {
    TopicStatistics statistics;
    const auto connection = std::make_shared<Connection>(Connection{"/a", fields});
    for (int i = 0; i <= 10; ++i) statistics.add(messageAt(1 + 0.2 * i, connection));
    EXPECT_FALSE(statistics.fellSilent(ros::Time(100)));
  }
}

TEST(Account, NamesTopicsOfWhichNothingCame) {
  TopicStatistics one;
  one.add(messageAt(1, connectionWith("")));
  EXPECT_EQ(accountText({{"/a", one}, {"/b", {}}}, {{2.0, 0.5}}, {{"/a", 1}}),
            R"({"topics": {"/a": {"received": 1, "dropped": 1}, )"
            R"("/b": {"received": 0, "dropped": 0}}, )"
            R"("clock_jumps": [{"time": 2, "seconds": 0.5}]})");
}

TEST(Statistics, KnowTypesThatBeginWithAHeader) {
  EXPECT_TRUE(beginsWithHeader("std_msgs/Header header\nfloat32 x"));
  EXPECT_FALSE(beginsWithHeader("float32 x\nHeader header"));
  EXPECT_FALSE(beginsWithHeader(""));
}

}  // namespace
}  // namespace process_visualizer::recorder

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
