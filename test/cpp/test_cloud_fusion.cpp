// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_types.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <algorithm>
#include <array>
#include <boost/make_shared.hpp>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include "process_visualizer/cloud/fused_clouds.hpp"
#include "process_visualizer/cloud/voxel_grid.hpp"

namespace process_visualizer::cloud {
namespace {

using Color = std::array<std::uint8_t, 3>;  // blue, green, red
using sensor_msgs::PointCloud2;

struct TestPoint {
  Eigen::Vector3f position;
  Color color;
};

const Eigen::Isometry3d kHere = Eigen::Isometry3d::Identity();

PointCloud2 makeCloud(const std::vector<TestPoint>& points) {
  PointCloud2 cloud;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(2, "xyz", "rgb");
  modifier.resize(points.size());
  sensor_msgs::PointCloud2Iterator<float> position(cloud, "x");
  sensor_msgs::PointCloud2Iterator<std::uint8_t> color(cloud, "rgb");
  for (const TestPoint& point : points) {
    std::copy(point.position.begin(), point.position.end(), &position[0]);
    std::copy(point.color.begin(), point.color.end(), &color[0]);
    ++position;
    ++color;
  }
  return cloud;
}

std::vector<TestPoint> pointsOf(const PointCloud2& cloud) {
  std::vector<TestPoint> points;
  sensor_msgs::PointCloud2ConstIterator<float> position(cloud, "x");
  sensor_msgs::PointCloud2ConstIterator<std::uint8_t> color(cloud, "rgb");
  for (; position != position.end(); ++position, ++color)
    points.push_back({{position[0], position[1], position[2]}, {color[0], color[1], color[2]}});
  return points;
}

std::vector<TestPoint> anyPoints(std::size_t count, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<float> place(-0.2f, 0.2f);
  std::vector<TestPoint> points;
  for (std::size_t i = 0; i < count; ++i)
    points.push_back({{place(generator), place(generator), place(generator)},
                      {static_cast<std::uint8_t>(generator()), 7, 200}});
  return points;
}

Eigen::Isometry3d tilted() {
  Eigen::Isometry3d pose(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  pose.translation() << 0.1, -0.2, 0.3;
  return pose;
}

using Place = std::array<int, 3>;

Place placeOf(const Eigen::Vector3f& position, float voxels_per_meter) {
  const Eigen::Vector3f place = position * voxels_per_meter;
  return {static_cast<int>(std::floor(place.x())), static_cast<int>(std::floor(place.y())),
          static_cast<int>(std::floor(place.z()))};
}

TEST(VoxelGrid, KeepsTheMeansThatBruteForceFinds) {
  const auto one = anyPoints(20000, 1), other = anyPoints(10000, 2);
  VoxelGrid grid(0.01);
  grid.add(makeCloud(one), kHere);
  grid.add(makeCloud(other), tilted());
  std::map<Place, std::vector<TestPoint>> expected;
  const auto expect = [&](const TestPoint& point, const Eigen::Isometry3f& pose) {
    const Eigen::Vector3f position = pose * point.position;
    expected[placeOf(position, 100)].push_back({position, point.color});
  };
  for (const TestPoint& point : one) expect(point, kHere.cast<float>());
  for (const TestPoint& point : other) expect(point, tilted().cast<float>());

  const auto found = pointsOf(grid.cloud({}));
  ASSERT_EQ(found.size(), expected.size());
  for (const auto& [place, points] : expected) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double blue = 0;
    for (const TestPoint& point : points) {
      sum += point.position.cast<double>();
      blue += point.color[0];
    }
    const Eigen::Vector3f mean = (sum / points.size()).cast<float>();
    const auto match = std::find_if(found.begin(), found.end(), [&](const TestPoint& point) {
      return (point.position - mean).norm() < 1e-6f;
    });
    ASSERT_NE(match, found.end());
    EXPECT_NEAR(match->color[0], blue / points.size(), 0.5);
    EXPECT_EQ((std::array<int, 2>{match->color[1], match->color[2]}), (std::array<int, 2>{7, 200}));
  }
}

TEST(VoxelGrid, KeepsThePointsOfPcl) {
  const auto points = anyPoints(30000, 3);
  const auto input = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const TestPoint& point : points)
    input->push_back({point.position.x(), point.position.y(), point.position.z()});
  pcl::VoxelGrid<pcl::PointXYZ> filter;
  filter.setInputCloud(input);
  filter.setLeafSize(0.02f, 0.02f, 0.02f);
  pcl::PointCloud<pcl::PointXYZ> expected;
  filter.filter(expected);

  VoxelGrid grid(0.02);
  grid.add(makeCloud(points), kHere);
  auto found = pointsOf(grid.cloud({}));
  // One point in each voxel, so that sorting by voxels pairs them.
  const auto before = [](const auto& a, const auto& b) { return placeOf(a, 50) < placeOf(b, 50); };
  std::sort(found.begin(), found.end(),
            [&](const TestPoint& a, const TestPoint& b) { return before(a.position, b.position); });
  std::sort(expected.begin(), expected.end(), [&](const auto& a, const auto& b) {
    return before(Eigen::Vector3f(a.getVector3fMap()), Eigen::Vector3f(b.getVector3fMap()));
  });
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i)
    EXPECT_LT((found[i].position - expected[i].getVector3fMap()).norm(), 1e-5f);
}

TEST(VoxelGrid, IsEmptyAfterClear) {
  VoxelGrid grid(0.01);
  grid.add(makeCloud(anyPoints(5000, 4)), kHere);
  grid.clear();
  EXPECT_EQ(grid.cloud({}).width, 0u);
  grid.add(makeCloud(anyPoints(1, 5)), kHere);
  EXPECT_EQ(grid.cloud({}).width, 1u);
}

TEST(VoxelGrid, MakesPointsWithoutColourGrey) {
  auto cloud = makeCloud(anyPoints(1, 6));
  cloud.fields.pop_back();
  VoxelGrid grid(0.01);
  grid.add(cloud, kHere);
  EXPECT_EQ(pointsOf(grid.cloud({}))[0].color, (Color{200, 200, 200}));
}

TEST(VoxelGrid, RefusesEdgesThatAreNone) {
  for (const double edge : {0.0, -1.0, 1e-320, static_cast<double>(NAN), 1.0 / 0.0})
    EXPECT_THROW(VoxelGrid{edge}, std::invalid_argument);
}

constexpr double kSilence = 1.0;

class FusedCloudsTest : public testing::Test {
 protected:
  /// \param stamp_s  of the cloud; a time after the epoch in whole seconds
  void take(std::size_t sensor, double now_s, std::uint32_t stamp_s = 100) {
    const auto cloud = boost::make_shared<PointCloud2>();
    cloud->header.stamp = ros::Time(stamp_s, 0);
    cloud->width = sensor;
    clouds_.take(sensor, {cloud, kHere}, now_s);
  }

  std::vector<std::size_t> next(double now_s) {
    std::vector<std::size_t> sensors;
    for (const PlacedCloud& placed : clouds_.next(now_s)) sensors.push_back(placed.cloud->width);
    return sensors;
  }

  using Sensors = std::vector<std::size_t>;
  FusedClouds clouds_{3, kSilence};
};

TEST_F(FusedCloudsTest, WaitForTheSlowest) {
  EXPECT_FALSE(clouds_.isComplete(0));
  take(0, 0.1);
  take(1, 0.1);
  take(0, 0.2);
  EXPECT_FALSE(clouds_.isComplete(0.2));
  take(2, 0.3);
  EXPECT_TRUE(clouds_.isComplete(0.3));
  EXPECT_EQ(next(0.3), (Sensors{0, 1, 2}));
  take(0, 0.4);
  EXPECT_FALSE(clouds_.isComplete(0.4));
}

TEST_F(FusedCloudsTest, LeaveOutWhoIsSilentAndTakeItBack) {
  for (const std::size_t sensor : {0, 1, 2}) take(sensor, 0.0);
  next(0.0);
  take(0, 1.05);
  take(2, 1.05);
  EXPECT_TRUE(clouds_.isSilent(1, 1.05));
  EXPECT_TRUE(clouds_.isComplete(1.05));
  EXPECT_EQ(next(1.05), (Sensors{0, 2}));
  for (const std::size_t sensor : {0, 1, 2}) take(sensor, 1.1);
  EXPECT_FALSE(clouds_.isSilent(1, 1.1));
  EXPECT_EQ(next(1.1), (Sensors{0, 1, 2}));
}

TEST_F(FusedCloudsTest, ForgetWhatIsBeforeAJump) {
  take(0, 0.0, 100);
  take(1, 0.0, 200);  // arrived before the player said that it has jumped
  next(0.0);
  clouds_.jump(ros::Time(150, 0), 0.0);
  take(2, 0.0, 149);  // arrived too late
  EXPECT_FALSE(clouds_.isComplete(0.0));
  EXPECT_EQ(next(0.0), (Sensors{1}));
}

TEST_F(FusedCloudsTest, AreNewOnceMoreAfterAJump) {
  for (const std::size_t sensor : {0, 1}) take(sensor, 0.0, 200);
  next(0.0);
  clouds_.jump(ros::Time(150, 0), 0.0);
  EXPECT_TRUE(clouds_.hasNew());
  take(2, 0.0, 200);
  EXPECT_TRUE(clouds_.isComplete(0.0));
}

TEST_F(FusedCloudsTest, AnyOrderOfEventsJoinsOnlyFreshCloudsOfOnePosition) {
  std::mt19937 generator(11);
  double now_s = 0;
  std::array<double, 3> heard_s{};
  std::uint32_t jump_s = 0;
  for (std::uint32_t event = 1; event < 5000; ++event) {
    now_s += 0.001 * (generator() % 400);
    if (generator() % 20 == 0) clouds_.jump(ros::Time(jump_s = event, 0), now_s);
    const std::size_t sensor = generator() % 3;
    take(sensor, now_s, event);
    heard_s[sensor] = now_s;
    if (!clouds_.isComplete(now_s)) continue;
    for (const PlacedCloud& placed : clouds_.next(now_s)) {
      EXPECT_LE(now_s - heard_s[placed.cloud->width], kSilence);
      EXPECT_GE(placed.cloud->header.stamp.sec, jump_s);
    }
    EXPECT_FALSE(clouds_.hasNew());
  }
}

TEST(DataClock, RunsAsTheWallClockWithoutAPlayer) {
  EXPECT_DOUBLE_EQ(DataClock().at(123.5), 123.5);
}

TEST(DataClock, StandsWhilePausedAndIsSlowWherePlaybackIs) {
  DataClock clock;
  clock.follow(100, 0);
  EXPECT_DOUBLE_EQ(clock.at(100.5), 100);
  clock.follow(100.5, -0.25);
  EXPECT_DOUBLE_EQ(clock.at(101.3), 100.2);
  clock.follow(101.3, 4);
  EXPECT_DOUBLE_EQ(clock.at(101.8), 100.7);
}

TEST(DataClock, RunsOnWhenThePlayerIsLost) {
  DataClock clock;
  clock.follow(100, 0);
  EXPECT_DOUBLE_EQ(clock.at(105), 104);
  EXPECT_DOUBLE_EQ(clock.at(90), 100);  // never back
}

}  // namespace
}  // namespace process_visualizer::cloud

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
