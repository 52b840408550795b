// SPDX-License-Identifier: BSD-3-Clause
/// Objects that a robot hides completely or partly, and objects that pass each other.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "process_visualizer/objects/object_tracks.hpp"
#include "small_cell.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// Compares the box of a partly hidden object with the complete size.
void expectSize(const UprightBox& box, Vector3f size) {
  Vector3f seen = box.size;
  std::sort(seen.data(), seen.data() + 2);
  std::sort(size.data(), size.data() + 2);
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(seen[axis], size[axis], 0.012);
}

class OcclusionTest : public testing::Test {
 protected:
  Cell cell_;
  std::mt19937 random_{7};
};

TEST_F(OcclusionTest, AnArmThatPassesDividesNoObject) {
  const Vector3f size(0.36F, 0.3F, 0.1F), place(0.45F, 0.3F, 0.05F);
  cell_.add(size, at(place, 0.3F));
  Follower follower(cell_);
  for (int frame = 0; frame < 60; ++frame) {
    cell_.poseRobot(-0.1F + 0.03F * static_cast<float>(frame));
    if (frame % 5 == 0) {  // even without earlier clouds
      EXPECT_EQ(cell_.find(random_).size(), 1U) << frame;
    }
    const auto tracked = follower.next(random_);
    ASSERT_EQ(tracked.size(), 1U) << frame;
    EXPECT_EQ(tracked[0].number, 1U);
    EXPECT_LT((tracked[0].object.box.center - place).norm(), 0.02) << frame;
    expectSize(tracked[0].object.box, size);
  }
}

/// The objects are seen as two before the arm hides the gap between them.
TEST_F(OcclusionTest, TwoObjectsStayTwoBelowAnArm) {
  cell_.add({0.2F, 0.2F, 0.1F}, at({0.4F, 0.17F, 0.05F}));
  cell_.add({0.2F, 0.2F, 0.1F}, at({0.4F, -0.17F, 0.05F}));
  Follower follower(cell_);
  for (int frame = 0; frame < 60; ++frame) {
    cell_.poseRobot(1.2F - 0.04F * static_cast<float>(frame));
    const auto tracked = follower.next(random_);
    ASSERT_EQ(tracked.size(), 2U) << frame;
    EXPECT_EQ(tracked[0].number + tracked[1].number, 3U);
    for (const TrackedObject& it : tracked) expectSize(it.object.box, {0.2F, 0.2F, 0.1F});
  }
}

TEST_F(OcclusionTest, WhatARobotHidesIsRemembered) {
  const Vector3f size(0.1F, 0.08F, 0.06F);
  cell_.add(size, at({0.35F, 0, 0.03F}));
  Follower follower(cell_);
  const auto at_yaw = [&](float yaw, int frames) {
    cell_.poseRobot(yaw);
    std::vector<TrackedObject> tracked;
    for (int frame = 0; frame < frames; ++frame) tracked = follower.next(random_);
    return tracked;
  };
  ASSERT_EQ(at_yaw(1, 4).size(), 1U);
  const auto hidden = at_yaw(0, 60);  // for 2 s
  ASSERT_EQ(hidden.size(), 1U);
  EXPECT_FALSE(hidden[0].is_seen);
  const auto seen = at_yaw(1, 1);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].number, 1U);
  EXPECT_TRUE(seen[0].is_seen);
  cell_.clear();
  EXPECT_EQ(at_yaw(1, 15).size(), 1U);  // shown paler for 0.6 s, as its place is seen
  EXPECT_TRUE(at_yaw(1, 5).empty());
}

/// One object passes the other so closely that the sensor sees them as one.
TEST_F(OcclusionTest, ObjectsThatPassEachOtherKeepTheirNumbers) {
  const Vector3f small(0.12F, 0.12F, 0.12F), large(0.25F, 0.2F, 0.15F);
  const Vector3f place(-0.55F, -0.2F, 0.075F);
  cell_.poseRobot(0.5F);
  std::set<std::uint32_t> of_small, of_large;
  std::size_t touching = 0;
  Follower follower(cell_);
  for (int frame = 0; frame < 70; ++frame) {
    const float x = -0.9F + 0.01F * static_cast<float>(frame);
    const Vector3f passing(x, -0.02F, 0.06F);
    cell_.clear();
    cell_.add(large, at(place));
    cell_.add(small, at(passing));
    if (frame % 5 == 0 && cell_.find(random_).size() == 1) ++touching;
    const auto tracked = follower.next(random_);
    ASSERT_EQ(tracked.size(), 2U) << frame;
    SCOPED_TRACE(frame);
    for (const TrackedObject& it : tracked) {
      const bool is_large = (it.object.box.center - place).norm() < 0.03;
      (is_large ? of_large : of_small).insert(it.number);
      expectSize(it.object.box, is_large ? large : small);
    }
  }
  EXPECT_GT(touching, 2U);  // clouds that show one object without those before
  EXPECT_EQ(of_small.size(), 1U);
  EXPECT_EQ(of_large.size(), 1U);
}

/// A box with those points of its upper side whose coordinate along a direction is below a limit.
FoundObject truncatedBox(const UprightBox& box, const Vector2f& direction, float limit) {
  FoundObject found{box, 0, std::nullopt};
  const int steps = 40;
  const auto placeAt = [&](int column, int row) -> Vector3f {
    const Vector3f inside(box.size.x() * (static_cast<float>(column) / steps - 0.5F),
                          box.size.y() * (static_cast<float>(row) / steps - 0.5F),
                          box.size.z() / 2);
    return box.center + Eigen::AngleAxisf(box.yaw, Vector3f::UnitZ()) * inside;
  };
  const auto isHidden = [&](const Vector3f& place) {
    return direction.dot(place.head<2>() - box.center.head<2>()) > limit;
  };
  const int ways[][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
  for (int column = 0; column <= steps; ++column) {
    for (int row = 0; row <= steps; ++row) {
      const Vector3f place = placeAt(column, row);
      if (isHidden(place)) continue;
      found.places.push_back(place);
      for (const auto& [right, up] : ways) {
        const int next_column = column + right, next_row = row + up;
        const bool is_end =
            std::min(next_column, next_row) < 0 || std::max(next_column, next_row) > steps;
        const Vector3f beside = placeAt(next_column, next_row);
        if (is_end || isHidden(beside))
          found.rim.push_back({place, (beside - place).normalized(), isHidden(beside)});
      }
    }
  }
  found.points = found.places.size();
  return found;
}

TEST(PartlyHidden, TheWholeIsKnownWhereverItIsCut) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> any(-1, 1);
  for (int round = 0; round < 300; ++round) {
    const UprightBox box{{any(random), any(random), 0.1F},
                         {0.2F + 0.1F * any(random), 0.2F + 0.1F * any(random), 0.2F},
                         3 * any(random)};
    // Parallel to an edge, or nearly so: three sides show where the box is.
    const float angle =
        box.yaw + static_cast<float>(M_PI_2) * static_cast<float>(round % 4) + 0.2F * any(random);
    const FoundObject found =
        truncatedBox(box, {std::cos(angle), std::sin(angle)}, 0.05F * any(random));
    UprightBox predicted = box;
    predicted.center += 0.05F * Vector3f(any(random), any(random), 0);  // it moves unevenly
    const UprightBox seen = completed(predicted, found);
    EXPECT_LT((seen.center - box.center).norm(), 0.012) << round;
    EXPECT_LT((seen.size - box.size).norm(), 0.012) << round;
  }
}

}  // namespace
}  // namespace process_visualizer::objects

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
