// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <pcl/filters/crop_box.h>
#include <pcl/point_types.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "process_visualizer/cloud/box.hpp"
#include "process_visualizer/cloud/cloud_layout.hpp"
#include "process_visualizer/cloud/roi_filter.hpp"

namespace process_visualizer::cloud {
namespace {

using Point = std::array<float, 3>;
using Indices = std::vector<std::uint32_t>;
using sensor_msgs::PointCloud2;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
const Box kUnitBox({0, 0, 0}, {2, 2, 2});

/// A cloud of one row with fields x, y, z, rgb; rgb is the point's index.
PointCloud2 makeCloud(const std::vector<Point>& points) {
  PointCloud2 cloud;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(2, "xyz", "rgb");
  modifier.resize(points.size());
  sensor_msgs::PointCloud2Iterator<float> position(cloud, "x");
  sensor_msgs::PointCloud2Iterator<std::uint32_t> color(cloud, "rgb");
  for (std::size_t i = 0; i < points.size(); ++i, ++position, ++color) {
    std::copy(points[i].begin(), points[i].end(), &position[0]);
    *color = i;
  }
  cloud.header.frame_id = "camera";
  cloud.header.stamp = ros::Time(12, 34);
  return cloud;
}

/// The indices (in rgb) of a cloud's points.
Indices indices(const PointCloud2& cloud) {
  Indices result;
  sensor_msgs::PointCloud2ConstIterator<std::uint32_t> color(cloud, "rgb");
  for (; color != color.end(); ++color) result.push_back(*color);
  return result;
}

Indices crop(const PointCloud2& cloud, const Box& box = kUnitBox,
             const Eigen::Isometry3d& transform = Eigen::Isometry3d::Identity()) {
  return indices(cropToBox(cloud, transform, box));
}

TEST(CropToBox, KeepsWhatIsStrictlyInside) {
  const auto cloud = makeCloud({{0, 0, 0.1f}, {1, 0, 0}, {0.99f, -0.99f, 0.99f}, {0, -1.01f, 0}});
  EXPECT_EQ(crop(cloud), (Indices{0, 2}));
}

TEST(CropToBox, LeavesOutWhatLiesOnAnyOfItsSides) {
  EXPECT_EQ(crop(makeCloud({{1, 0, 0.1f},
                            {-1, 0, 0.1f},
                            {0, 1, 0.1f},
                            {0, -1, 0.1f},
                            {0, 0, 1},
                            {0, 0, -1},
                            {0, 0, 0.1f}})),
            Indices{6});
}

TEST(CropToBox, SizeIsTheFullEdgeAndCenterTheMiddle) {
  const Box box({10, 20, 30}, {1, 2, 4});
  const auto cloud = makeCloud({{10.4f, 20, 30},
                                {10.6f, 20, 30},
                                {10, 20.9f, 30},
                                {10, 21.1f, 30},
                                {10, 20, 28.1f},
                                {10, 20, 27.9f}});
  EXPECT_EQ(crop(cloud, box), (Indices{0, 2, 4}));
}

TEST(CropToBox, DropsPointsThatWereNotMeasured) {
  const auto cloud = makeCloud({{kNaN, 0, 0},
                                {0, kNaN, 0},
                                {0, 0, kNaN},
                                {kInfinity, 0, 0},
                                {0, -kInfinity, 0},
                                {0, 0, 0},
                                {0, -0.0f, 0},
                                {0, 0, 0.1f}});
  EXPECT_EQ(crop(cloud), (Indices{7}));
}

TEST(CropToBox, TransformsIntoTheFrameOfTheBox) {
  // A quarter turn about z and a shift: the cloud's (1, 0, 0) is the box frame's (5, 1, 0).
  Eigen::Isometry3d box_from_cloud =
      Eigen::Translation3d(5, 0, 0) * Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());
  const auto cloud = makeCloud({{1, 0, 0}, {0, 1, 0}, {5, 1, 0}});
  EXPECT_EQ(crop(cloud, Box({5, 1, 0}, {0.1, 0.1, 0.1}), box_from_cloud), (Indices{0}));
}

TEST(CropToBox, LeavesPositionsHeaderAndFieldsAsTheyWere) {
  const auto cloud = makeCloud({{9, 9, 9}, {0.1f, 0.2f, 0.3f}});
  const Eigen::Isometry3d shift(Eigen::Translation3d(0.5, 0, 0));
  const auto cropped = cropToBox(cloud, shift, kUnitBox);
  EXPECT_EQ(cropped.header.frame_id, "camera");
  EXPECT_EQ(cropped.header.stamp, ros::Time(12, 34));
  EXPECT_EQ(cropped.fields, cloud.fields);
  EXPECT_EQ(cropped.data,
            std::vector<std::uint8_t>(cloud.data.begin() + cloud.point_step, cloud.data.end()));
}

TEST(CropToBox, GivesOneDenseRow) {
  auto cloud = makeCloud({{0, 0, 0.1f}, {kNaN, 0, 0}, {0, 5, 0}, {0, 0.5f, 0}});
  cloud.width = 2;
  cloud.height = 2;
  cloud.row_step = 2 * cloud.point_step;
  cloud.is_dense = false;
  const auto cropped = cropToBox(cloud, Eigen::Isometry3d::Identity(), kUnitBox);
  EXPECT_EQ(indices(cropped), (Indices{0, 3}));
  EXPECT_EQ(cropped.height, 1u);
  EXPECT_EQ(cropped.width, 2u);
  EXPECT_EQ(cropped.row_step, 2 * cloud.point_step);
  EXPECT_EQ(cropped.data.size(), cropped.row_step);
  EXPECT_TRUE(cropped.is_dense);
}

TEST(CropToBox, SkipsPaddingBetweenRows) {
  auto cloud = makeCloud({{0, 0, 0.1f}, {0, 0, 0.2f}, {0, 0, 0.3f}, {0, 0, 0.4f}});
  cloud.width = 1;  // every second point is padding
  cloud.height = 2;
  cloud.row_step = 2 * cloud.point_step;
  EXPECT_EQ(crop(cloud), (Indices{0, 2}));
}

TEST(CropToBox, TakesAnyOrderAndAlignmentOfFields) {
  const float x = 0.1f, y = 5, z = 0.3f;
  PointCloud2 cloud;
  cloud.width = cloud.height = 1;
  cloud.point_step = cloud.row_step = 15;
  cloud.data.resize(15, 0xAB);
  const auto addField = [&](const char* name, int offset, float value) {
    sensor_msgs::PointField field;
    field.name = name;
    field.offset = offset;
    field.datatype = sensor_msgs::PointField::FLOAT32;
    field.count = 1;
    cloud.fields.push_back(field);
    std::memcpy(&cloud.data[offset], &value, sizeof(value));
  };
  addField("z", 1, z);
  addField("y", 11, y);
  addField("x", 5, x);
  const auto transform = Eigen::Isometry3d::Identity();
  EXPECT_EQ(cropToBox(cloud, transform, Box({x, y, z}, {0.01, 0.01, 0.01})).data, cloud.data);
  EXPECT_EQ(cropToBox(cloud, transform, Box({z, y, x}, {0.01, 0.01, 0.01})).width, 0u);
}

TEST(CropToBox, AcceptsAnEmptyCloud) {
  const auto cropped = cropToBox(makeCloud({}), Eigen::Isometry3d::Identity(), kUnitBox);
  EXPECT_EQ(cropped.width, 0u);
  EXPECT_EQ(cropped.height, 1u);
  EXPECT_TRUE(cropped.data.empty());
}

TEST(CropToBox, DoesNotVisitRowsWithoutPoints) {
  auto cloud = makeCloud({});
  cloud.width = cloud.row_step = 0;
  cloud.height = 0xFFFFFFFF;
  EXPECT_EQ(rowsWithPoints(cloud), 0u);
  EXPECT_EQ(crop(cloud), Indices{});
}

std::vector<Point> randomPoints(std::mt19937& generator, std::size_t count) {
  std::uniform_real_distribution<float> coordinate(-2, 2);
  std::vector<Point> points(count);
  for (Point& point : points)
    for (float& value : point) value = generator() % 50 == 0 ? kNaN : coordinate(generator);
  return points;
}

Eigen::Isometry3d randomTransform(std::mt19937& generator) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Eigen::Vector3d axis(uniform(generator), uniform(generator), uniform(generator));
  const Eigen::Vector3d shift(uniform(generator), uniform(generator), uniform(generator));
  return Eigen::Translation3d(shift) * Eigen::AngleAxisd(3 * uniform(generator), axis.normalized());
}

Indices cropWithPcl(const std::vector<Point>& points, const Box& box,
                    const Eigen::Isometry3d& box_from_cloud) {
  const pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (const Point& point : points) cloud->push_back({point[0], point[1], point[2]});
  cloud->is_dense = false;  // or PCL keeps points with NaN
  pcl::CropBox<pcl::PointXYZ> filter;
  filter.setInputCloud(cloud);
  filter.setTransform(Eigen::Affine3f(box_from_cloud.cast<float>()));
  const Eigen::Vector3f center = box.center().cast<float>();
  const Eigen::Vector3f extents = box.halfExtents().cast<float>();
  filter.setMin((center - extents).homogeneous());
  filter.setMax((center + extents).homogeneous());
  pcl::Indices kept;
  filter.filter(kept);
  return Indices(kept.begin(), kept.end());
}

TEST(CropToBox, AgreesWithPclOnRandomClouds) {
  std::mt19937 generator(1);
  std::size_t kept_count = 0;
  for (int round = 0; round < 50; ++round) {
    const auto points = randomPoints(generator, 2000);
    const auto transform = randomTransform(generator);
    const Box box({0.2, -0.3, 0.1}, {2.0, 1.6, 2.4});
    const auto expected = cropWithPcl(points, box, transform);
    EXPECT_EQ(crop(makeCloud(points), box, transform), expected);
    kept_count += expected.size();
  }
  EXPECT_GT(kept_count, 50u * 50);
}

/// One kind of damage to a valid cloud, and the text that the message must contain.
struct BadCloud {
  std::string message;
  std::function<void(PointCloud2&)> damage;
};

const BadCloud kBadClouds[] = {
    {"big-endian", [](PointCloud2& cloud) { cloud.is_bigendian = true; }},
    {"no field 'x'", [](PointCloud2& cloud) { cloud.fields[0].name = "X"; }},
    {"no field 'z'", [](PointCloud2& cloud) { cloud.fields[2].name = "depth"; }},
    {"no field 'x'", [](PointCloud2& cloud) { cloud.fields.clear(); }},
    {"'y' is not of type FLOAT32",
     [](PointCloud2& cloud) { cloud.fields[1].datatype = sensor_msgs::PointField::FLOAT64; }},
    {"'z' ends beyond its point",
     [](PointCloud2& cloud) { cloud.fields[2].offset = cloud.point_step - 3; }},
    {"'z' ends beyond its point", [](PointCloud2& cloud) { cloud.fields[2].offset = 0xFFFFFFFF; }},
    {"'x' ends beyond its point", [](PointCloud2& cloud) { cloud.point_step = 0; }},
    {"row_step", [](PointCloud2& cloud) { cloud.row_step = 0; }},
    {"row_step", [](PointCloud2& cloud) { --cloud.row_step; }},
    {"row_step", [](PointCloud2& cloud) { cloud.width = 0xFFFFFFFF; }},
    {"cut off", [](PointCloud2& cloud) { cloud.data.pop_back(); }},
    {"cut off", [](PointCloud2& cloud) { cloud.data.clear(); }},
    {"cut off", [](PointCloud2& cloud) { cloud.height = 0xFFFFFFFF; }},
};

TEST(CropToBox, SaysWhatIsWrongWithACloud) {
  for (const BadCloud& bad : kBadClouds) {
    auto cloud = makeCloud({{0, 0, 0.1f}, {1, 1, 1}});
    bad.damage(cloud);
    try {
      crop(cloud);
      ADD_FAILURE() << "accepted, expected: " << bad.message;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(bad.message), std::string::npos) << error.what();
    }
  }
}

TEST(Outline, HasTheTwelveEdgesOfTheBox) {
  const visualization_msgs::Marker outline = outlineOf(Box({0, 0, 1.5}, {1.0, 0.8, 1.0}), "box");
  EXPECT_EQ(outline.type, visualization_msgs::Marker::LINE_LIST);
  EXPECT_EQ(outline.header.frame_id, "box");
  EXPECT_TRUE(outline.frame_locked);
  ASSERT_EQ(outline.points.size(), 24u);
  const auto place = [&outline](std::size_t i) {
    return std::array<double, 3>{outline.points[i].x, outline.points[i].y, outline.points[i].z};
  };
  std::set<std::set<std::array<double, 3>>> edges;
  for (std::size_t i = 0; i < 24; i += 2) {
    edges.insert({place(i), place(i + 1)});
    int different = 0;
    for (int axis = 0; axis < 3; ++axis) different += place(i)[axis] != place(i + 1)[axis];
    EXPECT_EQ(different, 1);
    EXPECT_EQ(std::abs(place(i)[0]), 0.5);
    EXPECT_EQ(std::abs(place(i)[1]), 0.4);
    EXPECT_EQ(std::abs(place(i)[2] - 1.5), 0.5);
  }
  EXPECT_EQ(edges.size(), 12u);
}

TEST(Box, RejectsWhatIsNoBox) {
  EXPECT_THROW(Box({0, 0, 0}, {1, 0, 1}), std::invalid_argument);
  EXPECT_THROW(Box({0, 0, 0}, {1, -1, 1}), std::invalid_argument);
  EXPECT_THROW(Box({0, 0, 0}, {1, kNaN, 1}), std::invalid_argument);
  EXPECT_THROW(Box({0, 0, 0}, {1, kInfinity, 1}), std::invalid_argument);
  EXPECT_THROW(Box({0, kNaN, 0}, {1, 1, 1}), std::invalid_argument);
}

}  // namespace
}  // namespace process_visualizer::cloud

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
