// SPDX-License-Identifier: BSD-3-Clause
/// Objects found in clouds of a small cell, as a Kinect would see it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "process_visualizer/objects/object_finder.hpp"
#include "small_cell.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector3f;

const Isometry3f kCamera = Cell::camera();
const FinderSettings kSettings;

class ObjectFinderTest : public testing::Test {
 protected:
  ObjectFinderTest() { cell_.poseRobot(0.3F); }

  /// Points of a sensor whose error is the same for whole patches. \param noise  m at 1 m
  Points patchy(float noise) {
    std::normal_distribution<float> normal(0, 1);
    Points points = cell_.picture().points(random_);
    std::vector<float> patches(points.width * points.height);
    for (float& patch : patches) patch = normal(random_);
    for (std::size_t index = 0; index < points.places.size(); ++index) {
      const std::size_t row = index / points.width / 6, column = index % points.width / 6;
      Vector3f& place = points.places[index];
      place *= 1 + noise * place.norm() * patches[row * points.width + column];
    }
    return points;
  }

  Cell cell_;
  std::mt19937 random_{5};
};

TEST_F(ObjectFinderTest, NothingInAClearCell) {
  for (const float yaw : {-2.0F, 0.0F, 0.7F, 3.0F}) {
    cell_.poseRobot(yaw);
    EXPECT_TRUE(cell_.find(random_).empty()) << yaw;
  }
}

/// A stereo sensor with a short baseline is wrong by 2 cm at 2.2 m, for whole patches.
TEST_F(ObjectFinderTest, NothingInAClearCellOfANoisySensor) {
  for (const float yaw : {-2.0F, 0.0F, 0.7F, 3.0F}) {
    cell_.poseRobot(yaw);
    const Points points = patchy(0.004F);
    ObjectFinder finder(cell_.bodies(), kSettings);
    const auto labels = finder.label(points, cell_.scene());
    EXPECT_TRUE(finder.find(points, labels, cell_.scene()).empty()) << yaw;
  }
}

TEST_F(ObjectFinderTest, ItIsKnownHowSmallSomethingMayBe) {
  FinderSettings settings;
  const auto limit = [&](const Points& points) {
    ObjectFinder finder(cell_.bodies(), settings);
    return finder.detectionLimit(points, finder.label(points, cell_.scene()));
  };
  const Points points = cell_.picture().points(random_);
  EXPECT_LT(limit(points)->size, 0.04F);
  settings.noise = DepthNoise{0.0042F};
  const auto noisy = limit(points);
  EXPECT_NEAR(noisy->size, 4 * 0.0042F * noisy->range * noisy->range, 1e-4F);
  EXPECT_GT(noisy->size, 0.05F);
  EXPECT_FALSE(limit(Points{{Vector3f::Constant(NAN)}, 1, 1}));
}

TEST_F(ObjectFinderTest, TheRobotAndNothingElseIsKnown) {
  std::size_t robot = 0, missed = 0, others = 0, wrong = 0;
  for (const float yaw : {-2.0F, 0.0F, 0.7F, 3.0F}) {
    cell_.poseRobot(yaw);
    DepthCamera camera = cell_.picture();
    const auto labels =
        ObjectFinder(cell_.bodies(), kSettings).label(camera.points(random_), cell_.scene());
    for (std::size_t pixel = 0; pixel < labels.size(); ++pixel) {
      if (camera.things()[pixel] < 0) continue;  // nothing, or a mixed pixel
      const bool is_known = labels[pixel] != Label::kFree;
      ++(camera.things()[pixel] == kRobot ? robot : others);
      if (camera.things()[pixel] == kRobot && !is_known) ++missed;
      if (camera.things()[pixel] != kRobot && is_known) ++wrong;
    }
  }
  EXPECT_GT(robot, 50000U);
  EXPECT_LE(missed, robot / 200);
  EXPECT_LE(wrong, others / 200);
}

TEST_F(ObjectFinderTest, AnObjectHasItsSizePlaceAndDistance) {
  const Vector3f size(0.3F, 0.2F, 0.15F), place(-0.3F, -0.2F, 0.075F);
  cell_.add(size, at(place, 0.5F));
  const auto found = cell_.find(random_);
  ASSERT_EQ(found.size(), 1U);
  const UprightBox& box = found[0].box;
  const float longer = std::max(box.size.x(), box.size.y());
  const float shorter = std::min(box.size.x(), box.size.y());
  EXPECT_NEAR(longer, size.x(), 0.01);
  EXPECT_NEAR(shorter, size.y(), 0.01);
  EXPECT_NEAR(box.size.z(), size.z(), 0.01);
  EXPECT_LT((box.center - place).norm(), 0.01);
  ASSERT_TRUE(found[0].robot);
  EXPECT_EQ(found[0].robot->link, "upper_arm");
  const auto& [link, distance, on_object, on_robot] = *found[0].robot;
  EXPECT_NEAR(distance, (on_object - on_robot).norm(), 0.001);
}

TEST_F(ObjectFinderTest, FiveObjectsAreFive) {
  const Vector3f hand(0.1F, 0.18F, 0.06F);
  cell_.add(hand, at({-0.5F, 0.4F, 0.03F}));
  cell_.add(hand, at({-0.4F, -0.4F, 0.45F}));  // it hovers
  cell_.add({0.2F, 0.2F, 0.2F}, at({0.4F, -0.35F, 0.1F}, 0.7F));
  cell_.add({0.08F, 0.08F, 0.3F}, at({0.0F, 0.4F, 0.15F}));
  cell_.add({0.15F, 0.1F, 0.05F}, at({-0.1F, -0.1F, 0.025F}, 1.2F));
  EXPECT_EQ(cell_.find(random_).size(), 5U);
}

/// From above, the shoulder hides the part between the chest and the arm.
TEST_F(ObjectFinderTest, AnArmBesideSomebodyIsNoObjectOfItsOwn) {
  cell_.add({0.3F, 0.3F, 0.9F}, at({-0.5F, 0.2F, 0.45F}));
  cell_.add({0.3F, 0.08F, 0.08F}, at({-0.45F, -0.1F, 0.5F}));
  EXPECT_EQ(cell_.find(random_).size(), 1U);
}

/// The visible part of a hand has fewer pixels than an object.
TEST_F(ObjectFinderTest, TheTipOfALimbCountsForTheDistanceOfSomebody) {
  const Vector3f tip(-0.1F, 0.25F, 0.5F);
  for (const bool has_tip : {false, true}) {
    cell_.clear();
    cell_.add({0.3F, 0.3F, 0.9F}, at({-0.6F, 0.2F, 0.45F}));
    if (has_tip) cell_.add({0.016F, 0.012F, 0.012F}, at(tip));
    const auto found = cell_.find(random_);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ((found[0].robot->on_object - tip).norm() < 0.02F, has_tip);
  }
}

/// A rod is too thin to be an object.
TEST_F(ObjectFinderTest, WhatSomebodyHoldsCountsForTheirDistance) {
  const Vector3f rod(-0.2F, 0.2F, 0.7F);
  cell_.add({0.3F, 0.3F, 0.9F}, at({-0.6F, 0.2F, 0.45F}));
  cell_.add({0.2F, 0.015F, 0.015F}, at(rod));
  const auto found = cell_.find(random_);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_LT((found[0].robot->on_object - rod).norm(), 0.12F);
}

/// A tip does not count for a box far away.
TEST_F(ObjectFinderTest, ATipIsOfNothingThatIsFarAway) {
  cell_.add({0.3F, 0.3F, 0.3F}, at({-0.6F, 0.2F, 0.15F}));
  const float alone = cell_.find(random_).at(0).robot->distance;
  cell_.add({0.016F, 0.012F, 0.012F}, at({-0.1F, 0.25F, 0.5F}));
  EXPECT_NEAR(cell_.find(random_).at(0).robot->distance, alone, 0.01F);
}

/// The leg reaches 0.5 m to the side, and is as thin as any leg.
TEST_F(ObjectFinderTest, ALegThatSwingsBesideSomebodyIsNoObjectOfItsOwn) {
  cell_.add({0.3F, 0.3F, 0.9F}, at({-0.5F, 0.2F, 0.45F}));
  cell_.add({0.08F, 0.08F, 0.75F},
            at({-0.45F, -0.12F, 0.42F}) * Eigen::AngleAxisf(0.6F, Vector3f::UnitY()));
  EXPECT_EQ(cell_.find(random_).size(), 1U);
}

/// Legs and a chest are two groups, neither of them as high as a person.
TEST_F(ObjectFinderTest, AFootBesideTheLegsOfSomebodyIsNoObjectOfItsOwn) {
  cell_.add({0.3F, 0.3F, 0.4F}, at({-0.5F, 0.2F, 0.7F}));
  cell_.add({0.2F, 0.2F, 0.3F}, at({-0.32F, 0.2F, 0.15F}));
  cell_.add({0.2F, 0.08F, 0.08F}, at({-0.32F, -0.1F, 0.04F}));
  EXPECT_EQ(cell_.find(random_).size(), 1U);
}

/// A chest and legs that were seen as two objects move on as one; two standing objects stay two.
TEST_F(ObjectFinderTest, PartsOfSomebodyThatMoveTogetherAreOne) {
  const Vector3f chest(0.3F, 0.3F, 0.4F), legs(0.2F, 0.2F, 0.3F);
  const Vector3f above(-0.5F, 0.2F, 0.7F), below(-0.32F, 0.2F, 0.15F);
  cell_.add(chest, at(above));
  cell_.add(legs, at(below));
  const Points points = cell_.picture().points(random_);
  const auto found = [&](const Vector3f& one, const Vector3f& other, bool stands) {
    ObjectFinder finder(cell_.bodies(), kSettings);
    const auto labels = finder.label(points, cell_.scene());
    return finder
        .find(points, labels, cell_.scene(),
              {{{above, chest, 0}, true, !stands, stands, one},
               {{below, legs, 0}, true, !stands, stands, other}})
        .size();
  };
  const Vector3f speed(0.9F, 0.3F, 0);
  EXPECT_EQ(found(speed, {0.5F, 0.4F, 0}, false), 1U);
  EXPECT_EQ(found(speed, -speed, false), 2U);
  EXPECT_EQ(found(Vector3f::Zero(), Vector3f::Zero(), true), 2U);
}

TEST_F(ObjectFinderTest, AnArmAboveABoxIsNoPartOfIt) {
  cell_.add({0.2F, 0.2F, 0.15F}, at({-0.5F, 0.2F, 0.075F}));
  cell_.add({0.5F, 0.08F, 0.08F}, at({-0.5F, 0.3F, 0.38F}));
  EXPECT_EQ(cell_.find(random_).size(), 2U);
}

TEST_F(ObjectFinderTest, WhatReachesBeyondThePictureIsCut) {
  cell_.add({0.4F, 0.2F, 0.1F}, at({1.2F, 0.3F, 0.05F}));
  cell_.add({0.4F, 0.2F, 0.1F}, at({-0.5F, 0.3F, 0.05F}));
  const auto found = cell_.find(random_);
  ASSERT_EQ(found.size(), 2U);
  for (const FoundObject& it : found) EXPECT_EQ(it.isTruncated(), it.box.center.x() > 0);
}

TEST_F(ObjectFinderTest, SomethingThatHoversReachesNotDownToTheTable) {
  cell_.add({0.1F, 0.2F, 0.06F}, at({-0.6F, -0.4F, 0.4F}));
  const auto found = cell_.find(random_);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_GT(found[0].box.center.z() - found[0].box.size.z() / 2, 0.3F);
}

TEST_F(ObjectFinderTest, RightBelowTheCameraItReachesDownToTheTable) {
  cell_.poseRobot(3.0F);
  cell_.add({0.2F, 0.15F, 0.12F}, at({0.1F, 0.05F, 0.06F}));
  const auto found = cell_.find(random_);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].box.size.z(), 0.12, 0.01);
}

TEST_F(ObjectFinderTest, WhatIsExpectedOrOutsideTheRegionIsNoObject) {
  cell_.add({0.2F, 0.2F, 0.2F}, at({-0.4F, -0.2F, 0.1F}));
  const Points points = cell_.picture().points(random_);
  ObjectFinder finder(cell_.bodies(), kSettings);
  const auto count = [&](const Scene& scene) {
    return finder.find(points, finder.label(points, scene), scene).size();
  };
  Scene scene = cell_.scene();
  EXPECT_EQ(count(scene), 1U);
  const Eigen::Isometry3d from_camera = kCamera.cast<double>();
  scene.expected.emplace_back(from_camera, cloud::Box({-0.4, -0.2, 0.1}, {0.3, 0.3, 0.3}));
  EXPECT_EQ(count(scene), 0U);
  scene.expected.clear();
  scene.region.emplace(from_camera, cloud::Box({0.5, 0.5, 0.5}, {1, 1, 1}));
  EXPECT_EQ(count(scene), 0U);
}

/// A sensor that is wrong by 2 cm sees a box whose upper side is 1 cm below the region, or 1 cm
/// below an expected object. Then there is something 10 cm higher on it.
TEST_F(ObjectFinderTest, WhatNoiseMovesIntoTheRegionIsNoObject) {
  cell_.add({0.6F, 0.6F, 0.1F}, at({-0.3F, -0.2F, 0.6F}));
  const Eigen::Isometry3d from_camera = kCamera.cast<double>();
  Scene region = cell_.scene(), expected = region;
  region.region.emplace(from_camera, cloud::Box({0, 0, 1.16}, {3, 3, 1}));
  expected.region.emplace(from_camera, cloud::Box({0, 0, 1.06}, {3, 3, 1}));
  expected.expected.emplace_back(from_camera, cloud::Box({-0.3, -0.2, 0.62}, {0.7, 0.7, 0.08}));
  for (const std::size_t count : {0U, 1U}) {
    if (count == 1) cell_.add({0.3F, 0.2F, 0.2F}, at({-0.4F, -0.3F, 0.75F}));
    const Points points = patchy(0.012F);
    FinderSettings settings;
    settings.noise = DepthNoise{0.012F};
    for (const Scene& scene : {region, expected}) {
      ObjectFinder finder(cell_.bodies(), settings);
      EXPECT_EQ(finder.find(points, finder.label(points, scene), scene).size(), count);
    }
  }
}

TEST_F(ObjectFinderTest, ACoveredSensorDoesNotLookIntoTheRegion) {
  Scene scene = cell_.scene();
  scene.region.emplace(kCamera.cast<double>(), cloud::Box({0, 0, 0.4}, {2, 2, 0.8}));
  const auto looks = [&](const Points& points) {
    ObjectFinder finder(cell_.bodies(), kSettings);
    return ObjectFinder::looksIntoRegion(points, finder.label(points, scene), scene);
  };
  Points points = cell_.picture().points(random_);
  EXPECT_TRUE(looks(points));
  for (Vector3f& place : points.places) place *= 2;  // beyond the region
  EXPECT_TRUE(looks(points));
  for (Vector3f& place : points.places) place *= 0.05F / place.z();
  EXPECT_FALSE(looks(points));
}

TEST_F(ObjectFinderTest, ASensorThatWasMovedSeesThroughTheRobot) {
  const Points points = cell_.picture().points(random_);
  ObjectFinder finder(cell_.bodies(), kSettings);
  const auto agreement = [&](const Scene& scene) {
    return finder.agreement(points, finder.label(points, scene), scene);
  };
  Scene scene = cell_.scene();
  const Agreement right = agreement(scene);
  EXPECT_GT(right.on, 50U);
  EXPECT_LT(right.through, right.on / 20);
  EXPECT_FALSE(right.isContradiction());
  const Isometry3f turned(Eigen::AngleAxisf(0.2F, Vector3f::UnitX()));
  for (Isometry3f& pose : scene.cloud_from_body) pose = turned * pose;
  const Agreement wrong = agreement(scene);
  EXPECT_GT(wrong.through, 3 * wrong.on);
  EXPECT_TRUE(wrong.isContradiction());
}

/// A small robot is hit by only a few rays from far away.
TEST_F(ObjectFinderTest, OneThatIsSeenFromFarAwayDoesToo) {
  Eigen::Isometry3f pose = Cell::camera();
  pose.translation().z() = 4.2F;
  DepthCamera camera(pose);
  camera.draw(cloud::boxSurface({8, 8, 0.1F}), at({0, 0, -0.05F}), kTable);
  const Points points = camera.points(random_);
  Scene scene = cell_.scene();
  scene.global_from_cloud = pose;
  for (Isometry3f& it : scene.cloud_from_body) it = pose.inverse() * Cell::camera() * it;
  ObjectFinder finder(cell_.bodies(), kSettings);
  EXPECT_TRUE(finder.agreement(points, finder.label(points, scene), scene).isContradiction());
}

/// A wall and a box 6 cm in front of it are two objects; only the box is left once the wall is
/// outside of the region.
TEST_F(ObjectFinderTest, WhatStandsBeforeAWallIsNoPartOfIt) {
  Eigen::Isometry3f pose = Eigen::Isometry3f::Identity();
  const Vector3f ahead = Vector3f(-2.6F, 0, -1.1F).normalized();
  pose.linear() << Vector3f::UnitY(), ahead.cross(Vector3f::UnitY()), ahead;
  pose.translation() << 1.3F, 0, 1.8F;
  DepthCamera camera(pose);
  camera.draw(cloud::boxSurface({6, 6, 0.1F}), at({0, 0, -0.05F}), kTable);
  camera.draw(cloud::boxSurface({0.1F, 4, 2.4F}), at({-1.55F, 0, 1.2F}), kObject);
  camera.draw(cloud::boxSurface({0.3F, 0.4F, 0.6F}), at({-1.29F, 0.3F, 0.3F}), kObject);
  const Points points = camera.points(random_);
  Scene scene;
  scene.global_from_cloud = pose;
  const auto found = [&] {
    ObjectFinder finder({}, kSettings);
    return finder.find(points, finder.label(points, scene), scene);
  };
  const auto both = found();
  ASSERT_EQ(both.size(), 2U);
  EXPECT_NEAR(both[0].box.size.z(), 0.6F, 0.03F);
  EXPECT_LT((both[0].box.center - Vector3f(-1.29F, 0.3F, 0.3F)).norm(), 0.08F);
  EXPECT_GT(both[1].box.size.maxCoeff(), 1.8F);
  EXPECT_LT(both[1].box.size.head<2>().minCoeff(), 0.1F);
  scene.region.emplace(Eigen::Isometry3d(pose.cast<double>()),
                       cloud::Box{{0, 0, 1}, {2.9, 4, 2.5}});
  EXPECT_EQ(found().size(), 1U);
}

/// The upper disc of a drum hides the upper part of its core from a sensor that is a little higher.
/// A disc that hovers 0.2 m above something is an object of its own.
TEST_F(ObjectFinderTest, WhatIsRightBelowItsTopIsAPartOfIt) {
  Eigen::Isometry3f pose = Eigen::Isometry3f::Identity();
  const Vector3f ahead = Vector3f(-2, 0, -0.6F).normalized();
  pose.linear() << Vector3f::UnitY(), ahead.cross(Vector3f::UnitY()), ahead;
  pose.translation() << 1.3F, 0, 0.9F;
  Scene scene;
  scene.global_from_cloud = pose;
  scene.region.emplace(Eigen::Isometry3d(pose.cast<double>()),
                       cloud::Box{{-0.7, 0, 1}, {1.6, 1.6, 2.4}});
  for (const float height : {0.44F, 0.62F}) {
    DepthCamera camera(pose);
    camera.draw(cloud::boxSurface({6, 6, 0.1F}), at({0, 0, -0.05F}), kTable);
    camera.draw(cloud::boxSurface({0.6F, 0.6F, 0.04F}), at({-0.7F, 0, height - 0.02F}), kObject);
    camera.draw(cloud::boxSurface({0.24F, 0.24F, 0.4F}), at({-0.7F, 0, 0.2F}), kObject);
    const Points points = camera.points(random_);
    ObjectFinder finder({}, kSettings);
    const auto found = finder.find(points, finder.label(points, scene), scene);
    EXPECT_EQ(found.size(), height < 0.5F ? 1U : 2U);
  }
}

TEST_F(ObjectFinderTest, CloudsWithoutRowsAreTheSame) {
  cell_.add({0.2F, 0.2F, 0.2F}, at({-0.4F, -0.2F, 0.1F}));
  const Points rows = cell_.picture().points(random_);
  Points plain;
  std::vector<Label> expected;
  ObjectFinder finder(cell_.bodies(), kSettings);
  const auto labels = finder.label(rows, cell_.scene());
  for (std::size_t index = 0; index < labels.size(); ++index) {
    if (!rows.places[index].allFinite()) continue;
    plain.places.push_back(rows.places[index]);
    expected.push_back(labels[index]);
  }
  plain.width = plain.places.size();
  plain.height = 1;
  EXPECT_EQ(finder.label(plain, cell_.scene()), expected);
}

/// A surface seen at a flat angle, four pixels wide: the steps between neighbors are larger than on
/// a usual surface, but even. The mixed pixels of an edge lie anywhere between both surfaces.
TEST(StrayPoints, ASteepSurfaceIsThinAndAnEdgeIsStray) {
  Points points;
  points.width = points.height = 24;
  for (std::size_t row = 0; row < points.height; ++row) {
    for (std::size_t column = 0; column < points.width; ++column) {
      const bool is_steep = column >= 8 && column < 12;
      const bool is_edge = column == 18;
      float range = 2.5F;
      if (is_steep) range = 1.2F + 0.05F * static_cast<float>(column - 8);
      if (is_edge) range = 1.0F + 0.06F * static_cast<float>(row * 7 % 24);
      if (column > 18) range = 1;
      points.places.push_back(Vector3f(0, 0, range));
    }
  }
  std::vector<Label> labels(points.places.size(), Label::kFree);
  for (std::size_t pixel = 0; pixel < labels.size(); ++pixel)
    if (pixel / 24 > 2 && pixel / 24 < 6) labels[pixel] = Label::kNowhere;  // three rows are left
  markStrayPoints(points, labels);
  EXPECT_EQ(labels[1 * 24 + 9], Label::kThin);
  EXPECT_EQ(labels[12 * 24 + 18], Label::kStray);
  EXPECT_EQ(labels[12 * 24 + 22], Label::kFree);
}

TEST_F(ObjectFinderTest, MixedPixelsAtTheRobotsEdgesAreTakenOut) {
  int between = 0, left = 0;
  for (const float yaw : {-2.0F, 0.0F, 0.7F, 3.0F}) {
    cell_.poseRobot(yaw);
    const Points points = cell_.picture().points(random_);
    const auto labels = ObjectFinder(cell_.bodies(), kSettings).label(points, cell_.scene());
    for (std::size_t pixel = 0; pixel < labels.size(); ++pixel) {
      const Vector3f place = kCamera * points.places[pixel];
      if (!(place.z() > 0.06F && place.z() < 0.14F)) continue;  // nothing is there
      ++between;
      if (labels[pixel] == Label::kFree) ++left;
    }
  }
  EXPECT_GT(between, 50);
  EXPECT_LT(left, between / 10);
}

}  // namespace
}  // namespace process_visualizer::objects

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
