// SPDX-License-Identifier: BSD-3-Clause
/// Models as triangles and distance fields, clusters and boxes, against brute force.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "process_visualizer/objects/clusters.hpp"
#include "process_visualizer/objects/distance_field.hpp"
#include "process_visualizer/objects/known_bodies.hpp"
#include "process_visualizer/objects/support_planes.hpp"
#include "process_visualizer/objects/walls.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::Vector3f;

constexpr float kReach = 0.05F;  // m

class Places {
 public:
  /// A place in a cube around the origin.
  Vector3f next(float half) {
    std::uniform_real_distribution<float> along(-half, half);
    return {along(random_), along(random_), along(random_)};
  }

 private:
  std::mt19937 random_{3};
};

float bruteDistance(const cloud::Surface& mesh, const Vector3f& place) {
  float distance = std::numeric_limits<float>::infinity();
  for (const cloud::Triangle& it : mesh)
    distance = std::min(distance, (cloud::closestPoint(it, place) - place).norm());
  return distance;
}

/// A box without a lid, whose inside is a cavity.
cloud::Surface openBox() {
  cloud::Surface mesh;
  for (const auto& [size, place] :
       std::vector<std::pair<Vector3f, Vector3f>>{{{0.4F, 0.4F, 0.02F}, {0, 0, -0.2F}},
                                                  {{0.02F, 0.4F, 0.4F}, {0.2F, 0, 0}},
                                                  {{0.02F, 0.4F, 0.4F}, {-0.2F, 0, 0}},
                                                  {{0.4F, 0.02F, 0.4F}, {0, 0.2F, 0}},
                                                  {{0.4F, 0.02F, 0.4F}, {0, -0.2F, 0}}})
    cloud::append(mesh, cloud::boxSurface(size), Eigen::Affine3f(Eigen::Translation3f(place)));
  return mesh;
}

TEST(Triangle, ItsClosestPointIsThatOfManySamples) {
  Places places;
  for (int round = 0; round < 200; ++round) {
    const cloud::Triangle triangle{places.next(1), places.next(1), places.next(1)};
    const Vector3f place = places.next(2);
    float best = std::numeric_limits<float>::infinity();
    for (const Vector3f& sample : cloud::samplesOf(cloud::Surface{triangle}, 0.02F))
      best = std::min(best, (sample - place).norm());
    const float distance = (cloud::closestPoint(triangle, place) - place).norm();
    EXPECT_LE(distance, best + 1e-5F);
    EXPECT_GE(distance, best - 0.02F);
  }
}

TEST(DistanceField, IsThatOfAllTriangles) {
  for (const cloud::Surface& mesh :
       {cloud::boxSurface({0.3F, 0.2F, 0.1F}), cloud::cylinderSurface({0.2F, 0.2F, 0.3F}),
        cloud::sphereSurface({0.3F, 0.3F, 0.3F}), openBox()}) {
    const DistanceField field(mesh, kReach);
    Places places;
    for (int round = 0; round < 2000; ++round) {
      const Vector3f place = places.next(0.25F);
      const float expected = std::min(kReach, bruteDistance(mesh, place));
      EXPECT_NEAR(std::abs(field.distance(place)), expected, field.step());
    }
  }
}

TEST(DistanceField, WhatIsEnclosedIsInsideButNoCavity) {
  EXPECT_LT(DistanceField(cloud::sphereSurface({0.3F, 0.3F, 0.3F}), kReach).distance({0, 0, 0}), 0);
  const DistanceField open(openBox(), kReach);
  EXPECT_GE(open.distance({0, 0, 0}), kReach * 0.99F);
  EXPECT_GT(open.distance({0.15F, 0, 0}), 0.03F);
  EXPECT_LT(open.distance({0.2F, 0, 0}), 0.001F);
}

TEST(DistanceField, FarAwayAndNoNumbersAreNotNear) {
  const DistanceField field(cloud::boxSurface({0.1F, 0.1F, 0.1F}), kReach);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Vector3f& place : {Vector3f(5, 0, 0), Vector3f(nan, 0, 0), Vector3f(0, 0, -1e30F)})
    EXPECT_EQ(field.distance(place), kReach);
}

TEST(PosedBodies, CoverWhatTheirFieldsSay) {
  std::vector<KnownBody> bodies;
  std::vector<Eigen::Isometry3f> poses;
  Places places;
  for (int number = 0; number < 70; ++number) {  // more than the bits of a mask's word
    bodies.emplace_back("link", cloud::boxSurface({0.3F, 0.05F, 0.1F}), kReach, false);
    poses.push_back(Eigen::Translation3f(places.next(1.5F)) *
                    Eigen::AngleAxisf(static_cast<float>(number), places.next(1).normalized()));
  }
  const PosedBodies posed(bodies, poses);
  int covered = 0;
  for (int round = 0; round < 20000; ++round) {
    const Vector3f place = places.next(1.8F);
    const KnownBody* expected = nullptr;
    for (std::size_t body = 0; body < bodies.size() && expected == nullptr; ++body)
      if (bodies[body].field.distance(poses[body].inverse() * place) <= 0.03F)
        expected = &bodies[body];
    EXPECT_EQ(posed.covering(place, 0.03F), expected);
    covered += expected == nullptr ? 0 : 1;
  }
  EXPECT_GT(covered, 100);
}

TEST(PosedBodies, WithoutBodiesNothingIsCovered) {
  EXPECT_EQ(PosedBodies({}, {}).covering({0, 0, 0}, 1), nullptr);
}

TEST(RobotDistance, IsThatOfTheNearestTriangleOfARobot) {
  std::vector<KnownBody> bodies;
  bodies.emplace_back("near", cloud::boxSurface({0.1F, 0.1F, 0.1F}), kReach, false);
  bodies.emplace_back("arm", cloud::cylinderSurface({0.1F, 0.1F, 0.6F}), kReach, true);
  bodies.emplace_back("base", cloud::boxSurface({0.3F, 0.3F, 0.3F}), kReach, true);
  const std::vector<Eigen::Isometry3f> poses{Eigen::Isometry3f(Eigen::Translation3f(1, 0, 0)),
                                             Eigen::Isometry3f(Eigen::Translation3f(0, 1, 0)),
                                             Eigen::Isometry3f(Eigen::Translation3f(0, -1, 0))};
  Places places;
  for (int round = 0; round < 100; ++round) {
    const Vector3f place = places.next(1.5F);
    const auto found = distanceToRobots({place}, bodies, poses);
    ASSERT_TRUE(found);
    const float arm =
        bruteDistance(cloud::cylinderSurface({0.1F, 0.1F, 0.6F}), poses[1].inverse() * place);
    const float base =
        bruteDistance(cloud::boxSurface({0.3F, 0.3F, 0.3F}), poses[2].inverse() * place);
    EXPECT_NEAR(found->distance, std::min(arm, base), 0.012);
    if (std::abs(arm - base) > 0.02F) {
      EXPECT_EQ(found->link, arm < base ? "arm" : "base");
    }
  }
  EXPECT_FALSE(distanceToRobots({{0, 0, 0}}, {}, {}));
}

TEST(Clusters, AreThoseOfBruteForce) {
  Places places;
  for (int round = 0; round < 20; ++round) {
    std::vector<Vector3f> points;
    for (int number = 0; number < 150; ++number) points.push_back(places.next(0.3F));
    const float voxel = 0.04F;
    const auto clusters = clustersOf(points, voxel, 1);
    std::size_t count = 0;
    for (const Indices& one : clusters) {
      count += one.size();
      for (const Indices& other : clusters) {
        if (&one == &other) continue;
        for (const std::uint32_t a : one)
          for (const std::uint32_t b : other) EXPECT_GT((points[a] - points[b]).norm(), voxel);
      }
    }
    EXPECT_EQ(count, points.size());
    EXPECT_GT(clusters.size(), 1U);
  }
}

TEST(Clusters, TwoGroupsAreTwo) {
  std::vector<Vector3f> points;
  for (int number = 0; number < 100; ++number) {
    points.emplace_back(0.01F * static_cast<float>(number), 0, 0);
    points.emplace_back(0.01F * static_cast<float>(number), 0.2F, 0);
  }
  points.emplace_back(5, 5, 5);
  const auto clusters = clustersOf(points, 0.03F, 10);
  ASSERT_EQ(clusters.size(), 2U);
  EXPECT_EQ(clusters[0].size(), 100U);
}

TEST(SupportPlanes, ATiltedTableIsOneAndAWallIsNone) {
  Places places;
  std::vector<Vector3f> points;
  for (int number = 0; number < 3000; ++number) {
    const Vector3f place = places.next(0.8F);
    points.emplace_back(place.x(), place.y(), 0.3F + 0.05F * place.x());
    points.emplace_back(1, place.y(), place.z());
  }
  const SupportPlanes planes(points, {0, 0, 2}, 0.5F);
  EXPECT_TRUE(planes.contain({0.5F, 0, 0.325F}));
  EXPECT_FALSE(planes.contain({0.5F, 0, 0.4F}));
  EXPECT_FALSE(planes.contain({1, 0, 0.6F}));
  EXPECT_NEAR(*planes.heightBelow({-0.4F, 0.2F, 0.5F}, 0.1F), 0.28, 0.005);
  EXPECT_FALSE(planes.heightBelow({0, 0, 0.1F}, 0.1F));
  EXPECT_FALSE(SupportPlanes({}, {0, 0, 2}, 0.5F).contain({0, 0, 0}));
}

/// An axis-aligned box.
struct Block {
  Vector3f min, max;

  bool contains(const Vector3f& place) const {
    return (place.array() >= min.array()).all() && (place.array() <= max.array()).all();
  }
};

/// Points of blocks along a sensor's rays around the direction to a place, with noise along the
/// rays (m at 1 m).
std::vector<Vector3f> seen(const Vector3f& sensor, const Vector3f& place,
                           const std::vector<Block>& blocks, float noise) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal(0, 1);
  const Vector3f ahead = (place - sensor).normalized();
  const Vector3f aside = ahead.cross(Vector3f::UnitZ()).normalized(), up = aside.cross(ahead);
  std::vector<Vector3f> points;
  for (float x = -0.6F; x < 0.6F; x += 0.01F) {
    for (float y = -0.5F; y < 0.5F; y += 0.01F) {
      const Vector3f ray = (ahead + x * aside + y * up).normalized();
      float nearest = 10;
      for (const Block& block : blocks) {
        const Eigen::Array3f a = (block.min - sensor).array() / ray.array();
        const Eigen::Array3f b = (block.max - sensor).array() / ray.array();
        const float begin = a.min(b).maxCoeff(), end = a.max(b).minCoeff();
        if (begin > 0 && begin < end) nearest = std::min(nearest, begin);
      }
      if (nearest < 10)
        points.push_back(sensor + ray * (nearest + noise * nearest * nearest * normal(random)));
    }
  }
  return points;
}

const Block kGround{{-5, -5, -1}, {5, 5, 0}};
const Block kTable{{-0.5F, -0.5F, 0}, {0.5F, 0.5F, 0.7F}};

/// Share of the points in a block that are on a surface.
double shareOn(const SupportPlanes& planes, const std::vector<Vector3f>& points,
               const Block& block) {
  double all = 0, on = 0;
  for (const Vector3f& point : points) {
    if (!block.contains(point)) continue;
    all += 1;
    if (planes.contain(point)) on += 1;
  }
  EXPECT_GT(all, 20);
  return on / all;
}

TEST(SupportPlanes, EndWhereTheTableEnds) {
  const Vector3f sensor(2.5F, 0.3F, 2.2F);
  const Block person{{-0.2F, 1.0F, 0}, {0.2F, 1.3F, 1.7F}};
  const Block hand{{0.9F, -0.6F, 0.68F}, {1.1F, -0.4F, 0.71F}};
  for (const float noise : {0.0F, 0.004F}) {
    const auto points = seen(sensor, {0.3F, 0.2F, 0.4F}, {kGround, kTable, person, hand}, noise);
    const SupportPlanes planes(points, sensor, 0.5F);
    EXPECT_GT(shareOn(planes, points, {{-0.4F, -0.4F, 0.5F}, {0.4F, 0.4F, 0.9F}}), 0.99);
    EXPECT_EQ(shareOn(planes, points, {{-0.3F, 0.9F, 0.3F}, {0.3F, 1.4F, 1.5F}}), 0);
    EXPECT_EQ(shareOn(planes, points, {{0.9F, -0.6F, 0.6F}, {1.1F, -0.4F, 0.8F}}), 0);
    EXPECT_GT(shareOn(planes, points, {{0.8F, 0.3F, -0.2F}, {1.5F, 1.0F, 0.2F}}), 0.99);
  }
}

/// Past the table, the sensor sees nothing but a wall.
TEST(SupportPlanes, EndWhereTheSensorLooksAtAWall) {
  const Vector3f sensor(2.5F, 0.3F, 2.2F), beyond(-0.7F, 0, 0.7F);
  const auto points = seen(sensor, {0, 0, 0.7F}, {kTable, {{-2, -5, -1}, {-1.9F, 5, 3}}}, 0.0013F);
  std::vector<Vector3f> level, upright;
  for (const Vector3f& it : points) (it.x() < -1.7F ? upright : level).push_back(it);
  EXPECT_FALSE(SupportPlanes(level, sensor, 0.3F, {}, nullptr, upright).contain(beyond));
  EXPECT_TRUE(SupportPlanes(level, sensor, 0.3F).contain(beyond));
}

TEST(SupportPlanes, AreNotInWalls) {
  const Vector3f sensor(2.3F, 2.3F, 2.4F);
  const Block left{{-1.6F, -5, 0}, {-1.5F, 5, 3}}, right{{-5, -1.6F, 0}, {5, -1.5F, 3}};
  for (const float noise : {0.0013F, 0.004F}) {
    const auto points = seen(sensor, {0, 0, 0.5F}, {kGround, left, right, kTable}, noise);
    const SupportPlanes planes(points, sensor, 0.5F);
    EXPECT_NEAR(planes.noise().at_one_m, noise, 0.15F * noise);
    EXPECT_LT(shareOn(planes, points, {{-2, -5, 0.5F}, {-1.2F, 5, 1.7F}}), 0.02);
    EXPECT_LT(shareOn(planes, points, {{-5, -2, 0.5F}, {5, -1.2F, 1.7F}}), 0.02);
    EXPECT_GT(shareOn(planes, points, {{-0.4F, -0.4F, 0.5F}, {0.4F, 0.4F, 0.9F}}), 0.98);
  }
}

/// An arm hides a strip of the table; the part beyond is too small to be a surface by itself.
TEST(SupportPlanes, GoOnBehindWhatHidesThem) {
  const Vector3f sensor(0.9F, 0.8F, 2.4F);
  const Block arm{{0.1F, -2, 1.2F}, {0.2F, 2, 1.3F}};
  const auto points = seen(sensor, {0, 0, 0.5F}, {kGround, kTable, arm}, 0.0013F);
  const SupportPlanes planes(points, sensor, 0.5F);
  EXPECT_GT(shareOn(planes, points, {{-0.45F, -0.45F, 0.65F}, {0.45F, 0.45F, 0.75F}}), 0.99);
}

/// Beside walls and boxes, less than half of the points near the floor belong to it.
TEST(SupportPlanes, AreNotMadeNoisyByWhatStandsOnThem) {
  const Vector3f sensor(2.4F, 2.4F, 2.4F);
  std::vector<Block> blocks{
      kGround, {{-0.5F, -5, 0}, {-0.4F, 5, 3}}, {{-5, -0.5F, 0}, {5, -0.4F, 3}}};
  for (const float x : {-0.3F, 0.15F, 0.6F})
    for (const float y : {-0.3F, 0.15F, 0.6F})
      blocks.push_back({{x, y, 0}, {x + 0.3F, y + 0.3F, 0.3F + 0.22F * (x + y)}});
  const auto points = seen(sensor, {0.2F, 0.2F, 0.5F}, blocks, 0.0015F);
  EXPECT_NEAR(SupportPlanes(points, sensor, 0.5F).noise().at_one_m, 0.0015F, 0.0003F);
}

/// The last strip of a table is a part of it, wherever the borders of the tiles are.
TEST(SupportPlanes, ReachToTheEdge) {
  const Vector3f sensor(0.9F, 0.3F, 2.4F);
  for (float shift = 0; shift < 0.1F; shift += 0.005F) {
    const Block table{{-0.5F, -0.5F, 0.68F}, {0.5F + shift, 0.5F + shift, 0.7F}};
    const auto points = seen(sensor, {0, 0, 0.5F}, {kGround, table}, 0.0013F);
    std::vector<Vector3f> some;  // as of a larger cloud, of which a sample is used
    for (std::size_t index = 0; index < points.size(); index += 7) some.push_back(points[index]);
    const SupportPlanes planes(some, sensor, 0.5F);
    const Block strip{{0.44F + shift, -0.4F, 0.65F}, {0.51F + shift, 0.4F, 0.75F}};
    EXPECT_GT(shareOn(planes, points, strip), 0.99) << shift;
  }
}

/// A person who bends over a table hides a part of it; the rest still does not become an object.
TEST(SupportPlanes, StaySurfacesIfAPartIsHidden) {
  const Vector3f sensor(1.5F, 0.3F, 2.2F);
  const Block table{{-0.4F, -0.4F, 0.68F}, {0.4F, 0.4F, 0.7F}},
      back{{0.2F, 0, 1.2F}, {0.6F, 1, 1.4F}};
  const Block top{{-0.35F, -0.35F, 0.65F}, {0, 0.35F, 0.75F}};
  const Vector3f middle(0, 0, 0.5F);
  const SupportPlanes before(seen(sensor, middle, {kGround, table}, 0.0013F), sensor, 0.5F);
  const auto points = seen(sensor, middle, {kGround, table, back}, 0.0013F);
  EXPECT_EQ(shareOn(SupportPlanes(points, sensor, 0.5F), points, top), 0);
  const SupportPlanes after(points, sensor, 0.5F, std::nullopt, &before);
  EXPECT_GT(shareOn(after, points, top), 0.99);
}

const Block kLeftWall{{-2.1F, -5, 0}, {-2, 5, 3}}, kRightWall{{-5, -2.1F, 0}, {5, -2, 3}};
const Vector3f kOpposite(2.4F, 2.3F, 2.4F), kIntoCorner(-1, -1, 0.8F);

/// Share of the points in a block that are on a wall.
double shareOn(const Walls& walls, const std::vector<Vector3f>& points, const Block& block) {
  double all = 0, on = 0;
  for (const Vector3f& point : points) {
    if (!block.contains(point)) continue;
    all += 1;
    if (walls.wallAt(point)) on += 1;
  }
  EXPECT_GT(all, 20);
  return on / all;
}

TEST(Walls, AreApartFromWhatStandsBeforeThem) {
  const Block person{{-1.1F, -0.3F, 0}, {-0.8F, 0.2F, 1.75F}};
  for (const float noise : {0.0013F, 0.0038F}) {
    const auto points =
        seen(kOpposite, kIntoCorner, {kGround, kLeftWall, kRightWall, person}, noise);
    const Walls walls(points, kOpposite, {noise});
    ASSERT_EQ(walls.size(), 2U) << noise;
    EXPECT_GT(shareOn(walls, points, {{-2.3F, 0.5F, 0.3F}, {-1.7F, 1, 1.5F}}), 0.98) << noise;
    EXPECT_GT(shareOn(walls, points, {{0.5F, -2.3F, 0.3F}, {1, -1.7F, 1.5F}}), 0.98) << noise;
    EXPECT_NE(walls.wallAt({-2, 0.7F, 1}), walls.wallAt({0.7F, -2, 1})) << noise;
    EXPECT_LT(shareOn(walls, points, {{-1.2F, -0.2F, 0.2F}, {-0.7F, 0.1F, 1.7F}}), 0.01) << noise;
    EXPECT_LT(shareOn(walls, points, {{0, 0, -0.2F}, {1, 1, 0.2F}}), 0.01) << noise;
  }
}

TEST(Walls, AreWiderThanAPallet) {
  const Block goods{{-1, -0.6F, 0}, {-0.2F, 0.6F, 1.6F}};
  const Block table{{0.3F, -1.5F, 0}, {1, 1.5F, 0.5F}};
  const Vector3f sensor(3, 0.4F, 2.2F);
  EXPECT_EQ(Walls(seen(sensor, {0, 0, 0.7F}, {kGround, goods, table}, 0.0013F), sensor, {}).size(),
            0U);
}

TEST(Walls, StayWallsIfAPartIsHidden) {
  const Block crowd{{-0.6F, -1.5F, 0}, {-0.5F, 0.4F, 1.8F}};
  const Vector3f middle(-2, 0, 0.8F), sensor(2.4F, 0, 1.8F);
  const auto hidden = seen(sensor, middle, {kGround, kLeftWall, crowd}, 0.0013F);
  Walls walls(seen(sensor, middle, {kGround, kLeftWall}, 0.0013F), sensor, {});
  ASSERT_EQ(walls.size(), 1U);
  walls.update(hidden, sensor, {}, false);
  EXPECT_EQ(walls.wallAt({-2, 1.2F, 1}), 0U);
  walls.update(seen(sensor, middle, {kGround}, 0.0013F), sensor, {}, true);
  EXPECT_EQ(walls.size(), 0U);
}

TEST(SupportPlanes, TellHowNoisyTheSensorIs) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal(0, 1);
  const Vector3f sensor(0, 0, 2.2F);
  Places places;
  for (const float noise : {0.0F, 0.004F, 0.008F}) {
    std::vector<Vector3f> points;
    for (int number = 0; number < 5000; ++number) {
      const Vector3f place = places.next(0.5F).cwiseProduct(Vector3f(3, 3, 0));
      const Vector3f way = place - sensor;
      points.push_back(place + way.normalized() * noise * way.squaredNorm() * normal(random));
    }
    const SupportPlanes planes(points, sensor, 0.5F);
    EXPECT_NEAR(planes.noise().at_one_m, std::max(noise, DepthNoise::kKinect), 0.15F * noise);
    const auto beside = std::count_if(points.begin(), points.end(), [&](const Vector3f& point) {
      return !planes.contain(point);
    });
    EXPECT_LE(beside, 5);
  }
}

TEST(UprightBox, IsTheSmallestWhateverItsYaw) {
  Places places;
  for (const float yaw : {0.0F, 0.4F, 1.2F, -0.8F}) {
    Cluster points;
    for (int number = 0; number < 4000; ++number) {
      Vector3f place = places.next(0.5F).cwiseProduct(Vector3f(0.4F, 0.1F, 0.2F));
      place.z() = 0.1F;
      points.push_back(Eigen::AngleAxisf(yaw, Vector3f::UnitZ()) * place);
    }
    const UprightBox box = standing(boxAround(points), 0, 0.02F, {0, 0, 2});
    EXPECT_NEAR(std::max(box.size.x(), box.size.y()), 0.4, 0.01);
    EXPECT_NEAR(std::min(box.size.x(), box.size.y()), 0.1, 0.01);
    EXPECT_NEAR(box.size.z(), 0.1, 0.01);  // right below the sensor: down to the surface
  }
}

/// Two upright sides of a box are seen at a corner; the rectangle across the corner is as small as
/// the right one.
TEST(UprightBox, IsTheRightOneOverACorner) {
  Places places;
  for (const Eigen::Vector2f& size : {Eigen::Vector2f(0.1F, 0.1F), Eigen::Vector2f(0.3F, 0.37F)}) {
    Cluster points;
    for (int number = 0; number < 1000; ++number) {
      const Vector3f place = places.next(0.5F) + Vector3f(0.5F, 0.5F, 0);
      points.emplace_back(size.x() * place.x(), 0.001F * place.y(), place.z());
      points.emplace_back(0.001F * place.x(), size.y() * place.y(), place.z());
    }
    for (const float yaw : {0.0F, 0.3F, 0.8F}) {
      Cluster turned;
      for (const Vector3f& point : points)
        turned.push_back(Eigen::AngleAxisf(yaw, Vector3f::UnitZ()) * point);
      const UprightBox box = boxAround(turned);
      EXPECT_NEAR(box.size.head<2>().minCoeff(), size.x(), 0.01);
      EXPECT_NEAR(box.size.head<2>().maxCoeff(), size.y(), 0.01);
    }
  }
}

/// A hand high above the floor: if it reached down, its side would be seen, although it is nearly
/// below the sensor.
TEST(UprightBox, HoversWhereItsSideWouldBeSeenIfItReachedDown) {
  const Vector3f sensor(0, 0, 2.9F);
  const UprightBox hand{{0.37F, 0, 1.27F}, {0.2F, 0.1F, 0.06F}, 0};
  EXPECT_NEAR(standing(hand, 0, 0.05F, sensor).size.z(), 0.06, 1e-6);
  EXPECT_NEAR(standing(hand, 1.14F, 0.05F, sensor).size.z(), 0.16, 1e-6);  // 1 cm may be missed
}

/// Only upright sides are seen of a box that is higher than the sensor.
TEST(UprightBox, IsAsHighAsAnUprightFace) {
  Places places;
  Cluster points;
  for (int number = 0; number < 4000; ++number) {
    Vector3f place = places.next(0.5F).cwiseProduct(Vector3f(0.4F, 0, 0.6F));
    points.push_back(place);
  }
  EXPECT_NEAR(boxAround(points).size.z(), 0.6, 0.01);
}

/// If a box is seen from above, its level top counts, not a column with little of the top and much
/// of an upright side.
TEST(UprightBox, IsAsHighAsItsLevelTop) {
  Places places;
  Cluster points;
  const Vector3f half(0.151F, 0.151F, 0.1F);
  for (int number = 0; number < 6000; ++number) {
    Vector3f place = places.next(1.0F).cwiseProduct(Vector3f(half.x(), half.y(), 0.012F));
    place.z() += half.z();
    points.push_back(place);
  }
  for (int number = 0; number < 300; ++number) {
    Vector3f place = places.next(1.0F).cwiseProduct(half);
    place.x() = half.x();
    points.push_back(place);
  }
  const UprightBox box = boxAround(points);
  EXPECT_NEAR(box.center.z() + box.size.z() / 2, half.z(), 0.005);
}

/// Noise along the line of sight moves points beyond the ends of a top that is seen from the side,
/// and in front of a face; the box still fits the object.
TEST(UprightBox, IsNotLargerByTheNoiseOfTheSensor) {
  Places places;
  const float deviation = 0.015F;
  const auto noise = [&] {  // sum of twelve uniform numbers, nearly normal
    Vector3f sum = Vector3f::Zero();
    for (int number = 0; number < 4; ++number) sum += places.next(1.0F);
    return deviation * sum.sum() / 2;
  };
  Cluster top, with_face;
  for (int number = 0; number < 3000; ++number) {
    Vector3f place = places.next(0.5F).cwiseProduct(Vector3f(0.3F, 0.2F, 0));
    place.x() += noise();
    top.push_back(place);
    with_face.push_back(place);
    place = places.next(0.5F).cwiseProduct(Vector3f(0, 0.2F, 0.2F)) - Vector3f(0.15F, 0, 0.1F);
    place.x() += noise();
    with_face.push_back(place);
  }
  const Eigen::Vector2f blur(deviation, 0);
  EXPECT_NEAR(footprint(top, 0, blur).sizes().x(), 0.3, 0.01);
  EXPECT_NEAR(footprint(with_face, 0, blur).sizes().x(), 0.3, 0.025);
  EXPECT_NEAR(footprint(top, 0, blur).sizes().y(), 0.2, 0.003);
  EXPECT_GT(footprint(top, 0, {0, 0}).sizes().x(), 0.33);
  EXPECT_GT(footprint(with_face, 0, {0, 0}).sizes().x(), 0.34);
}

TEST(UprightBox, OnePointHasOne) {
  const UprightBox box = boxAround({{1, 2, 3}});
  EXPECT_EQ(box.center, Vector3f(1, 2, 3));
  EXPECT_EQ(box.size, Vector3f(0, 0, 0));
}

const char kStl[] =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1000 0 0\nvertex 0 1000 0\n"
    "endloop\nendfacet\nendsolid a\n";

std::vector<std::uint8_t> readStl(const std::string& url) {
  if (url != "package://p/a.stl") throw std::runtime_error("no " + url);
  return {kStl, kStl + sizeof(kStl) - 1};
}

std::string robot(const std::string& links) { return "<robot name='r'>" + links + "</robot>"; }

TEST(LinkGeometry, IsVisibleOrElseCollision) {
  const auto links = linkGeometries(
      robot("<link name='a'><visual><origin xyz='1 0 0' rpy='0 0 1.5707963'/><geometry>"
            "<mesh filename='package://p/a.stl' scale='0.001 0.001 0.001'/></geometry></visual>"
            "<collision><geometry><box size='9 9 9'/></geometry></collision></link>"
            "<joint name='ab' type='fixed'><parent link='a'/><child link='b'/></joint>"
            "<link name='b'><collision><geometry><sphere radius='0.2'/></geometry></collision>"
            "<collision><geometry><cylinder radius='0.1' length='1'/></geometry></collision></link>"
            "<joint name='ac' type='fixed'><parent link='a'/><child link='c'/></joint>"
            "<link name='c'/>"),
      readStl);
  ASSERT_EQ(links.size(), 2U);
  EXPECT_EQ(links[0].frame, "a");
  const auto bounds = cloud::boundsOf(links[0].mesh);
  EXPECT_LT((bounds.min() - Vector3f(0, 0, 0)).norm(), 1e-5);
  EXPECT_LT((bounds.max() - Vector3f(1, 1, 0)).norm(), 1e-5);
  EXPECT_LT((cloud::boundsOf(links[1].mesh).sizes() - Vector3f(0.4F, 0.4F, 1)).norm(), 0.01);
}

TEST(LinkGeometry, BadDescriptionsAreRefused) {
  EXPECT_THROW(linkGeometries("no robot", readStl), std::invalid_argument);
  EXPECT_THROW(cloud::readSurface({1, 2, 3}, "a.stl"), std::invalid_argument);
  EXPECT_THROW(cloud::readSurface({}, "a"), std::invalid_argument);
  std::string deep;  // a parser may recurse for each nested element
  for (int i = 0; i < 200'000; ++i) deep += "<a>";
  EXPECT_THROW(linkGeometries(robot(deep), readStl), std::invalid_argument);
}

}  // namespace
}  // namespace process_visualizer::objects

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
