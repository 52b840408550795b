// SPDX-License-Identifier: BSD-3-Clause
/// Object numbers are stable, even through occlusions, and nothing survives a jump in time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <vector>

#include "process_visualizer/objects/assignment.hpp"
#include "process_visualizer/objects/object_messages.hpp"
#include "process_visualizer/objects/object_tracks.hpp"
#include "process_visualizer/objects/played_recording.hpp"
#include "process_visualizer/objects/pose_gaps.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::Vector3f;

constexpr double kPeriod = 1.0 / 30;  // s

FoundObject object(const Vector3f& place, const Vector3f& size = {0.1F, 0.2F, 0.1F},
                   float yaw = 0) {
  return {{place, size, yaw}, 100, RobotDistance{"arm", 0.3F, place, place + Vector3f(0.3F, 0, 0)}};
}

const Vector3f kSmall(0.04F, 0.2F, 0.04F);  // m: may be noise

TEST(ObjectTracks, ASmallObjectIsSeenThreeTimesFirst) {
  ObjectTracks tracks;
  EXPECT_TRUE(tracks.update(0, {}).empty());
  EXPECT_TRUE(tracks.update(0.03, {object({0, 0, 0}, kSmall)}).empty());
  EXPECT_TRUE(tracks.update(0.06, {object({0, 0, 0}, kSmall)}).empty());
  const auto seen = tracks.update(0.09, {object({0, 0, 0}, kSmall)});
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].number, 1U);
  EXPECT_TRUE(seen[0].is_seen);
}

TEST(ObjectTracks, ALargeOneIsShownAtOnceAsUnconfirmed) {
  ObjectTracks tracks;
  tracks.update(0, {});
  for (int frame = 1; frame <= 3; ++frame) {
    const auto seen = tracks.update(frame * kPeriod, {object({0, 0, 0})});
    ASSERT_EQ(seen.size(), 1U);
    EXPECT_EQ(seen[0].number, 1U);
    EXPECT_EQ(seen[0].is_confirmed, frame == 3);
  }
  tracks.reset();
  tracks.update(0, {});
  tracks.update(kPeriod, {object({0, 0, 0})});
  EXPECT_TRUE(tracks.update(2 * kPeriod, {}).empty());
}

/// A box of 15 cm flies at 3 m/s towards a robot that stands, and is observed five times a second.
TEST(ObjectTracks, WhatIsFastHasOneNumberAVelocityAndATimeToContact) {
  ObjectTracks tracks;
  tracks.update(0, {});
  for (int frame = 1; frame < 6; ++frame) {
    const float away = 4 - 0.6F * static_cast<float>(frame);
    FoundObject box = object({-away, 0, 0}, {0.15F, 0.15F, 0.15F});
    box.robot = RobotDistance{"arm", away, {-away, 0, 0}, {0, 0, 0}};
    const auto seen = tracks.update(0.2 * frame, {box});
    ASSERT_EQ(seen.size(), 1U);
    EXPECT_EQ(seen[0].number, 1U);
    if (frame == 1) continue;
    EXPECT_NEAR(seen[0].velocity.x(), 3, 0.01);
    ASSERT_TRUE(seen[0].contact_s);
    EXPECT_NEAR(*seen[0].contact_s, away / 3, 0.01);
  }
}

TEST(ObjectTracks, WhatGoesAwayHasNoTimeToContact) {
  ObjectTracks tracks;
  for (int frame = 0; frame < 9; ++frame) {
    FoundObject box = object({0, 0, 0});
    box.robot->distance = 0.3F + 0.05F * static_cast<float>(frame);
    EXPECT_FALSE(tracks.update(0.1 * frame, {box})[0].contact_s);
  }
}

/// A robot that lowers over an object hides it and comes nearer all the time.
TEST(ObjectTracks, TheDistanceOfAHiddenObjectIsThatOfTheRobotNow) {
  ObjectTracks tracks;
  const auto isHidden = [](const UprightBox&) { return true; };
  float height = 0.3F;
  const auto distanceOf = [&](const Cluster& places) {
    return RobotDistance{"arm", height - places[0].z(), places[0], {0, 0, height}};
  };
  FoundObject seen = object({0, 0, 0});
  seen.places = {{0, 0, 0.05F}};
  tracks.update(0, {seen}, isHidden, distanceOf);
  for (int frame = 1; frame < 25; ++frame) {
    height -= 0.01F;
    const auto found = tracks.update(frame * kPeriod, {}, isHidden, distanceOf);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_FALSE(found[0].is_seen);
    EXPECT_FALSE(found[0].is_current);
    EXPECT_NEAR(found[0].object.robot->distance, height - 0.05F, 1e-6);
  }
}

TEST(ObjectTracks, WhatIsHiddenOfAnObjectMayBeNearer) {
  ObjectTracks tracks;
  const auto isHidden = [](const UprightBox&) { return true; };
  const auto distanceOf = [](const Cluster& places) {
    float nearest = 9;
    for (const Vector3f& place : places) nearest = std::min(nearest, 0.3F - place.x());
    return RobotDistance{"arm", nearest, places[0], {0.3F, 0, 0}};
  };
  FoundObject complete = object({0, 0, 0});
  complete.places = {{-0.05F, 0, 0}, {0.05F, 0, 0}};
  complete.robot = distanceOf(complete.places);
  FoundObject part = object({-0.03F, 0, 0}, {0.04F, 0.2F, 0.1F});
  part.points = 50;
  part.places = {{-0.05F, -0.1F, 0}, {-0.01F, 0.1F, 0}};
  part.robot = distanceOf(part.places);
  part.rim = {{{0, 0, 0}, {1, 0, 0}, true}};
  for (int frame = 0; frame < 3; ++frame) tracks.update(frame * kPeriod, {complete});
  const auto found = tracks.update(3 * kPeriod, {part}, isHidden, distanceOf);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_TRUE(found[0].is_seen);
  EXPECT_NEAR(found[0].object.robot->distance, 0.25F, 0.001);
}

/// A hand enters first, then the person it belongs to, 0.35 m beside it.
TEST(ObjectTracks, SomebodyWhoComesInHasTheNumberOfTheHand) {
  ObjectTracks tracks;
  tracks.update(0, {});
  FoundObject hand = object({-1.75F, -0.78F, 0.87F}, {0.1F, 0.06F, 0.17F});
  FoundObject body = object({-1.57F, -1.02F, 1.05F}, {0.54F, 0.46F, 1.41F});
  hand.rim = body.rim = {{{-1.8F, -0.8F, 0.9F}, {-1, 0, 0}, true}};
  ASSERT_EQ(tracks.update(0.2, {hand}).size(), 1U);
  const auto found = tracks.update(0.4, {body});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].number, 1U);
  EXPECT_TRUE(found[0].is_seen);
}

/// A person is not taken for an object that stands beside their path.
TEST(ObjectTracks, SomebodyHasNotTheNumberOfWhatStands) {
  ObjectTracks tracks;
  FoundObject pole = object({0.3F, 0.2F, 0.3F}, {0.1F, 0.1F, 0.5F});
  FoundObject body = object({0, 0, 0.9F}, {0.5F, 0.5F, 1.7F});
  pole.rim = {{{0.3F, 0.2F, 0.3F}, {-1, 0, 0}, true}};
  for (int frame = 0; frame < 4; ++frame) tracks.update(0.2 * frame, {pole});
  const auto found = tracks.update(0.8, {body});
  ASSERT_EQ(found.size(), 2U);
  EXPECT_FALSE(found[0].is_seen);
  EXPECT_TRUE(found[1].is_seen);
}

/// The only visible part of an object is too far from its center to be the complete object.
TEST(ObjectTracks, APartIsSeenAlsoAlone) {
  ObjectTracks tracks;
  FoundObject body = object({0, 0, 0.9F}, {0.6F, 0.6F, 1.8F});
  FoundObject leg = object({0.25F, 0.2F, 0.2F}, {0.2F, 0.1F, 0.4F});
  body.rim = leg.rim = {{{0.25F, 0.2F, 0.2F}, {1, 0, 0}, true}};
  for (int frame = 0; frame < 3; ++frame) tracks.update(frame * kPeriod, {body});
  const auto found = tracks.update(3 * kPeriod, {leg});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_TRUE(found[0].is_seen);
}

/// A robot in front of a pole divides it, and then goes away.
TEST(ObjectTracks, TwoPartsThatAreOneHaveOneNumber) {
  ObjectTracks tracks;
  const FoundObject complete = object({0, 0, 0.3F}, {0.1F, 0.1F, 0.6F});
  const auto parts = tracks.update(
      0, {object({0, 0, 0.1F}, {0.1F, 0.1F, 0.2F}), object({0, 0, 0.5F}, {0.1F, 0.1F, 0.2F})});
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(tracks.update(0.2, {complete}).size(), 1U);
}

/// A person leaves: a foot is seen separately from the rest, and then only the legs.
TEST(ObjectTracks, WhatIsLeftInViewOfSomebodyKeepsTheNumber) {
  const auto truncatedObject = [](const Vector3f& place, const Vector3f& size) {
    FoundObject it = object(place, size);
    it.rim = {{place, {1, 0, 0}, true}};
    it.places = {place - size / 2, place + size / 2};
    return it;
  };
  ObjectTracks tracks;
  for (int frame = 0; frame < 4; ++frame)
    tracks.update(0.2 * frame, {truncatedObject({0.24F * static_cast<float>(frame), 0, 0.85F},
                                                {0.6F, 0.5F, 1.7F})});
  tracks.update(0.8, {truncatedObject({0.81F, -0.06F, 0.76F}, {0.5F, 0.45F, 1.2F}),
                      truncatedObject({1.42F, -0.09F, 0.16F}, {0.1F, 0.06F, 0.06F})});
  const auto found = tracks.update(1, {truncatedObject({1.17F, 0, 0.45F}, {0.2F, 0.32F, 0.66F})});
  const auto first = std::find_if(found.begin(), found.end(),
                                  [](const TrackedObject& it) { return it.number == 1; });
  ASSERT_NE(first, found.end());
  EXPECT_TRUE(first->is_seen);
}

TEST(ObjectTracks, WhatComesIntoViewWhereAHandWentOutOfItIsAnotherOne) {
  const auto seen = [](float x, const Vector3f& size, std::size_t points) {
    FoundObject it = object({x, 0, 0}, size);
    it.rim = {{it.box.center, {1, 0, 0}, true}};
    it.places = {it.box.center};
    it.points = points;
    return it;
  };
  ObjectTracks tracks;
  for (int frame = 0; frame < 5; ++frame) {  // less and less of it is in view
    const auto step = static_cast<float>(frame);
    tracks.update(0.1 * frame, {seen(0.05F * step, {0.4F - 0.08F * step, 0.08F, 0.03F},
                                     1000 - 200 * static_cast<std::size_t>(frame))});
  }
  const auto rest = tracks.update(0.5, {seen(0.24F, {0.06F, 0.08F, 0.03F}, 150)});
  EXPECT_EQ(rest.back().number, 1U);
  const auto ball = tracks.update(0.6, {seen(0.2F, {0.22F, 0.22F, 0.2F}, 1500)});
  EXPECT_EQ(ball.back().number, 2U);
}

TEST(ObjectTracks, WhatComesIntoViewFarFromAHiddenThingIsAnotherOne) {
  const Vector3f size(0.3F, 0.3F, 0.3F);
  for (const float away : {0.2F, 0.45F}) {
    ObjectTracks tracks;
    for (int frame = 0; frame < 4; ++frame) tracks.update(0.1 * frame, {object({0, 0, 0}, size)});
    const auto is_hidden = [](const UprightBox&) { return true; };
    for (int frame = 4; frame < 14; ++frame) tracks.update(0.1 * frame, {}, is_hidden);
    const auto found = tracks.update(1.4, {object({away, 0, 0}, size)}, is_hidden);
    EXPECT_EQ(found.back().number, away < 0.25F ? 1U : 2U);
  }
}

TEST(ObjectTracks, ThePartThatIsNearestToARobotCounts) {
  ObjectTracks tracks;
  FoundObject part = object({0.2F, 0, 0}, {0.1F, 0.1F, 0.1F});
  part.robot->distance = 0.1F;
  part.places = {{0.15F, -0.05F, 0}, {0.25F, 0.05F, 0}};
  part.rim = {{{0.2F, 0, 0}, {1, 0, 0}, true}};
  const FoundObject rest = object({0, 0, 0}, {0.5F, 0.5F, 0.2F});
  tracks.update(0, {rest});
  const auto found = tracks.update(kPeriod, {rest, part});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_FLOAT_EQ(found[0].object.robot->distance, 0.1F);
}

/// A hand that comes into view beside a person is shown after three clouds. Until then its distance
/// counts for the person, unless it is too far away to be theirs.
TEST(ObjectTracks, TheDistanceOfWhatIsNotShownYetCountsForSomebodyBesideIt) {
  for (const bool is_beside : {true, false}) {
    ObjectTracks tracks;
    const FoundObject person = object({0, 0, 0.5F}, {0.3F, 0.4F, 1});
    FoundObject hand = object({0, is_beside ? 0.7F : 1.2F, 0.8F}, kSmall);
    hand.robot->distance = 0.1F;
    tracks.update(0, {person});
    const auto seen = tracks.update(kPeriod, {person, hand});
    ASSERT_EQ(seen.size(), 1U);
    EXPECT_FLOAT_EQ(seen[0].object.robot->distance, is_beside ? 0.1F : 0.3F);
    tracks.update(2 * kPeriod, {person, hand});
    const auto both = tracks.update(3 * kPeriod, {person, hand});
    ASSERT_EQ(both.size(), 2U);
    EXPECT_FLOAT_EQ(both[0].object.robot->distance, 0.3F);
  }
}

TEST(ObjectTracks, NoiseIsNoObject) {
  ObjectTracks tracks;
  for (int frame = 0; frame < 100; ++frame) {
    std::vector<FoundObject> found;
    if (frame % 3 != 0) found.push_back(object({0, 0, 0}, kSmall));
    EXPECT_TRUE(tracks.update(frame * kPeriod, found).empty());
  }
}

/// Five objects move and are hidden one after the other, for half a second each.
TEST(ObjectTracks, NumbersStayThroughOcclusions) {
  ObjectTracks tracks;
  std::mt19937 random(4);
  std::normal_distribution<float> noise(0, 0.005F);
  std::map<int, std::uint32_t> numbers;
  int exchanged = 0, seen = 0;
  for (int frame = 0; frame < 1000; ++frame) {
    const double time = frame * kPeriod;
    std::vector<FoundObject> found;
    std::vector<Vector3f> places;
    for (int number = 0; number < 5; ++number) {
      const auto angle = static_cast<float>(time + 1.3 * number);
      places.emplace_back(0.5F * static_cast<float>(number) + 0.15F * std::cos(angle),
                          0.3F * std::sin(angle), 0.1F);
      const bool is_hidden = frame > 10 && (frame / 20) % 5 == number && frame % 20 < 15;
      if (!is_hidden)
        found.push_back(object(places.back() + Vector3f(noise(random), noise(random), 0)));
    }
    std::shuffle(found.begin(), found.end(), random);
    for (const TrackedObject& it : tracks.update(time, found)) {
      for (int number = 0; number < 5; ++number) {
        if (!it.is_seen || (places[number] - it.object.box.center).norm() > 0.05F) continue;
        ++seen;
        if (numbers.emplace(number, it.number).first->second != it.number) ++exchanged;
      }
    }
  }
  EXPECT_GT(seen, 4000);
  EXPECT_LE(exchanged, 1);
}

/// A hovering hand: it is not always visible whether it reaches down to the floor.
TEST(ObjectTracks, ANumberStaysWhereverTheUndersideIsThoughtToBe) {
  ObjectTracks tracks;
  for (int frame = 0; frame < 60; ++frame) {
    const float height = frame / 10 % 2 == 0 ? 0.06F : 1.3F;
    const Vector3f place(0.01F * static_cast<float>(frame), 0, 0.3F - height / 2);
    const auto seen = tracks.update(frame * kPeriod, {object(place, {0.2F, 0.1F, height})});
    ASSERT_EQ(seen.size(), 1U) << frame;
    EXPECT_EQ(seen[0].number, 1U) << frame;
  }
}

TEST(ObjectTracks, WhatIsHiddenIsShownUntilItIsGone) {
  ObjectTracks tracks;
  for (int frame = 0; frame < 5; ++frame) tracks.update(frame * kPeriod, {object({0, 0, 0})});
  const auto hidden = tracks.update(0.5, {});
  ASSERT_EQ(hidden.size(), 1U);
  EXPECT_FALSE(hidden[0].is_seen);
  EXPECT_TRUE(tracks.update(0.9, {}).empty());
  const auto another = tracks.update(1.0, {object({0, 0, 0})});
  ASSERT_EQ(another.size(), 1U);
  EXPECT_EQ(another[0].number, 2U);
}

TEST(ObjectTracks, WhatIsHiddenIsRememberedAsLongAsItsPlaceIs) {
  ObjectTracks tracks;
  const auto always = [](const UprightBox&) { return true; };
  for (int frame = 0; frame < 5; ++frame) tracks.update(frame * kPeriod, {object({0, 0, 0})});
  for (double time = 0.2; time < 20; time += kPeriod) tracks.update(time, {}, always);
  const auto seen = tracks.update(20.05, {object({0, 0, 0})});
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].number, 1U);
  EXPECT_TRUE(seen[0].is_seen);
}

/// The prediction of an object on a circle is right after half a second.
TEST(ObjectTracks, WhatMovesOnACircleIsExpectedThere) {
  std::mt19937 random(6);
  std::normal_distribution<float> noise(0, 0.002F);
  const auto placeAt = [](double time) {
    return Vector3f(0.15F * std::cos(static_cast<float>(time)),
                    0.15F * std::sin(static_cast<float>(time)), 0.1F);
  };
  for (double begin = 0; begin < 6; begin += 0.5) {
    ObjectTracks tracks;
    for (int frame = 0; frame < 30; ++frame) {
      const double time = begin + frame * kPeriod;
      tracks.update(time, {object(placeAt(time) + Vector3f(noise(random), noise(random), 0))});
    }
    const double later = begin + 29 * kPeriod + 0.5;
    const auto expected = tracks.predictedAt(later);
    ASSERT_EQ(expected.size(), 1U);
    EXPECT_LT((expected[0].box.center - placeAt(later)).norm(), 0.03);
  }
}

/// Parts near a known object, next to something that may hide the rest of it.
TEST(ObjectTracks, APartIsNoNewObject) {
  ObjectTracks tracks;
  for (int frame = 0; frame < 5; ++frame)
    tracks.update(frame * kPeriod, {object({0, 0, 0}, {0.3F, 0.1F, 0.1F})});
  FoundObject part = object({0.1F, 0, 0}, {0.1F, 0.1F, 0.1F});
  part.places = {{0.05F, -0.05F, 0}, {0.15F, 0.05F, 0}};
  part.rim.push_back({{0.05F, 0, 0}, {-1, 0, 0}, true});
  FoundObject other = object({-0.1F, 0, 0}, {0.1F, 0.1F, 0.1F});
  other.places = {{-0.15F, -0.05F, 0}, {-0.05F, 0.05F, 0}};
  other.rim.push_back({{-0.05F, 0, 0}, {1, 0, 0}, true});
  for (int frame = 5; frame < 15; ++frame) {
    const auto seen = tracks.update(frame * kPeriod, {part, other});
    ASSERT_EQ(seen.size(), 1U);
    EXPECT_EQ(seen[0].number, 1U);
    EXPECT_NEAR(seen[0].object.box.size.x(), 0.3, 0.01);
  }
}

TEST(BestPairs, AreThoseOfBruteForce) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> any(0, 1);
  for (int round = 0; round < 300; ++round) {
    const int rows = 1 + round % 4, columns = 1 + (round / 4) % 4;
    Eigen::MatrixXf costs(rows, columns);
    for (int place = 0; place < costs.size(); ++place)
      costs(place) = any(random) < 0.3F ? kForbidden : any(random);
    float found = 0;
    const auto pairs = bestPairs(costs);
    for (int row = 0; row < rows; ++row)
      found += pairs[row] ? costs(row, static_cast<int>(*pairs[row])) : kForbidden;
    // Rows without a partner: additional columns stand for none.
    std::vector<int> order(columns + rows);
    std::iota(order.begin(), order.end(), 0);
    float best = kForbidden * 10;
    do {
      float sum = 0;
      for (int row = 0; row < rows; ++row)
        sum += order[row] < columns ? costs(row, order[row]) : kForbidden;
      best = std::min(best, sum);
    } while (std::next_permutation(order.begin(), order.end()));
    EXPECT_NEAR(found, best, 1e-2);
  }
}

TEST(ObjectTracks, NothingSurvivesAJumpOfTime) {
  for (const double jump : {-5.0, 60.0}) {
    ObjectTracks tracks;
    for (int frame = 0; frame < 5; ++frame)
      tracks.update(100 + frame * kPeriod, {object({0, 0, 0}), object({1, 0, 0})});
    const auto seen = tracks.update(100 + jump, {object({0.1F, 0, 0}, {0.3F, 0.3F, 0.3F})});
    ASSERT_EQ(seen.size(), 1U);  // the other one is forgotten, and this one's size not smoothed
    EXPECT_EQ(seen[0].number, 1U);
    EXPECT_EQ(seen[0].object.box.size, Vector3f(0.3F, 0.3F, 0.3F));
  }
}

TEST(ObjectTracks, ABoxIsNotTurnedByItsFourDescriptions) {
  ObjectTracks tracks;
  std::vector<TrackedObject> seen;
  for (int frame = 0; frame < 20; ++frame) {
    const bool is_turned = frame % 2 == 1;
    seen = tracks.update(frame * kPeriod,
                         {is_turned ? object({0, 0, 0}, {0.2F, 0.1F, 0.1F}, -M_PI_2 + 0.1F)
                                    : object({0, 0, 0}, {0.1F, 0.2F, 0.1F}, 0.1F)});
  }
  EXPECT_NEAR(seen[0].object.box.size.x(), 0.1, 1e-4);
  EXPECT_NEAR(seen[0].object.box.yaw, 0.1, 1e-4);
}

TEST(ObjectMessages, TheLineTurnsYellowAndRed) {
  std_msgs::Header header;
  header.frame_id = "world";
  const auto markers = [&](const Limits& limits) {
    return markersOf(messageOf({{7, object({0, 0, 0}), true}}, limits, header)).markers;
  };
  const auto clear = markers({0.2, 0.1}), warned = markers({0.4, 0.1}), near = markers({0.4, 0.35});
  ASSERT_EQ(clear.size(), 5U);
  const auto& line = clear.back();
  EXPECT_EQ(line.type, visualization_msgs::Marker::LINE_LIST);
  EXPECT_EQ(line.header.frame_id, "world");
  EXPECT_GT(line.color.b, 0.8F);
  EXPECT_GT(warned.back().color.g, 0.8F);
  EXPECT_LT(warned.back().color.b, 0.1F);
  EXPECT_LT(near.back().color.g, 0.2F);
  EXPECT_EQ(clear[3].text, "object 7: 10 x 20 x 10 cm\n0.30 m to arm");
}

const ros::WallTime kNow(2000.0);

TEST(PlayedRecording, AJumpCountsForPresentStampsOnly) {
  PlayedRecording recording;
  PlayerState state;
  state.segment = 1;
  state.since = ros::Time(1000.0);
  EXPECT_FALSE(recording.follow(state, kNow));  // the first state is no jump
  EXPECT_FALSE(recording.isBefore(ros::Time(999.9)) || recording.isJustAfter(ros::Time(1000.0)));
  state.segment = 2;
  EXPECT_TRUE(recording.follow(state, kNow));
  EXPECT_FALSE(recording.follow(state, kNow));
  EXPECT_TRUE(recording.isBefore(ros::Time(999.9)) && !recording.isJustAfter(ros::Time(999.9)));
  EXPECT_TRUE(recording.isJustAfter(ros::Time(1000.1)) && !recording.isBefore(ros::Time(1000.1)));
  for (const double recorded : {10.0, 1000.2, 5000.0}) {
    EXPECT_FALSE(recording.isBefore(ros::Time(recorded))) << recorded;
    EXPECT_FALSE(recording.isJustAfter(ros::Time(recorded))) << recorded;
  }
}

TEST(PlayedRecording, ACloudWaitsUntilThePlayerHasToldWhatItIs) {
  PlayedRecording recording;
  PlayerState state;
  const ros::Time stamp(1000.05);
  EXPECT_FALSE(recording.isAwaited(stamp, kNow));  // nothing is played
  state.segment = 1;
  recording.follow(state, kNow);
  EXPECT_FALSE(recording.isAwaited(stamp, kNow));
  state.segment = 2;
  state.since = ros::Time(1000.0);
  recording.follow(state, kNow);
  EXPECT_TRUE(recording.isAwaited(stamp, kNow));  // just after a jump
  state.restored.resize(1);
  state.restored[0].stamp = stamp;
  recording.follow(state, kNow);
  EXPECT_TRUE(recording.isRestored(stamp) && !recording.isAwaited(stamp, kNow));
  const ros::Time next(1000.08);
  EXPECT_FALSE(recording.isRestored(next) || recording.isAwaited(next, kNow));
  state.paused = true;
  recording.follow(state, kNow);
  EXPECT_TRUE(recording.isAwaited(next, kNow));
  EXPECT_FALSE(recording.isAwaited(next, kNow + ros::WallDuration(1.1)));  // it has ended
}

TEST(ObjectMessages, AClearCellShowsNothing) {
  const auto markers = markersOf(messageOf({}, {0.4, 0.2}, {})).markers;
  ASSERT_EQ(markers.size(), 1U);
  EXPECT_EQ(markers[0].action, visualization_msgs::Marker::DELETEALL);
}

geometry_msgs::TransformStamped poseAt(double stamp, double x) {
  geometry_msgs::TransformStamped pose;
  pose.header.stamp = ros::Time(stamp);
  pose.child_frame_id = "tool";
  pose.transform.translation.x = x;
  pose.transform.rotation.w = 1;
  return pose;
}

TEST(PoseGaps, AFrameThatMovedWithoutPosesHasAGap) {
  PoseGaps gaps;
  for (int count = 0; count < 10; ++count) gaps.add(poseAt(10 + 0.03 * count, 0));
  gaps.add(poseAt(14, 0.2));
  EXPECT_NEAR(gaps.around("tool", ros::Time(12)).value_or(0), 3.73, 1e-6);
  EXPECT_FALSE(gaps.around("tool", ros::Time(14)));
  EXPECT_FALSE(gaps.around("tool", ros::Time(10.2)));
  EXPECT_FALSE(gaps.around("other", ros::Time(12)));
  gaps.clear();
  EXPECT_FALSE(gaps.around("tool", ros::Time(12)));
}

TEST(PoseGaps, AWildStampDoesNoHarm) {
  PoseGaps gaps;
  for (const double stamp : {10.0, 4294967290.0, 10.03, 10.06}) gaps.add(poseAt(stamp, stamp));
  EXPECT_FALSE(gaps.around("tool", ros::Time(10.05)));
  auto slashed = poseAt(14, 0.2);
  slashed.child_frame_id = "/tool";
  gaps.add(slashed);
  EXPECT_TRUE(gaps.around("tool", ros::Time(12)));
}

TEST(PoseGaps, AFrameAtRestHasNone) {
  PoseGaps gaps;
  for (const double stamp : {10.0, 10.03, 10.06, 14.0}) gaps.add(poseAt(stamp, 0.1));
  EXPECT_FALSE(gaps.around("tool", ros::Time(12)));
}

TEST(PoseGaps, AFrameThatIsSentSlowlyHasNone) {
  PoseGaps gaps;
  for (int count = 0; count < 300; ++count) gaps.add(poseAt(10 + count, 0.1 * count));
  EXPECT_FALSE(gaps.around("tool", ros::Time(300.5)));
}

}  // namespace
}  // namespace process_visualizer::objects

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
