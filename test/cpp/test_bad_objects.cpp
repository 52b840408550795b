// SPDX-License-Identifier: BSD-3-Clause
/// Invalid clouds. Built with AddressSanitizer and UndefinedBehaviorSanitizer.
#include <gtest/gtest.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "process_visualizer/objects/object_tracks.hpp"
#include "process_visualizer/objects/point_image.hpp"

namespace process_visualizer::objects {
namespace {

using sensor_msgs::PointCloud2;

constexpr int kWidth = 40, kHeight = 30;

/// A table with an object on it, seen from above.
PointCloud2 makeCloud() {
  PointCloud2 cloud;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(2, "xyz", "rgb");
  modifier.resize(kWidth * kHeight);
  cloud.width = kWidth;
  cloud.height = kHeight;
  cloud.row_step = kWidth * cloud.point_step;
  sensor_msgs::PointCloud2Iterator<float> place(cloud, "x");
  for (int pixel = 0; pixel < kWidth * kHeight; ++pixel, ++place) {
    const int row = pixel / kWidth, column = pixel % kWidth;
    place[0] = 0.03F * static_cast<float>(column - kWidth / 2);
    place[1] = 0.03F * static_cast<float>(row - kHeight / 2);
    place[2] = row > 10 && row < 20 && column > 10 && column < 20 ? 1.8F : 2.0F;
  }
  return cloud;
}

/// Runs the complete pipeline, with a camera that looks down.
std::size_t countObjects(PointCloud2 cloud) {
  cloud.data.shrink_to_fit();  // so that the sanitizer sees each byte read beyond the data
  Scene scene;
  scene.global_from_cloud = Eigen::Translation3f(0, 0, 2) *
                            Eigen::AngleAxisf(static_cast<float>(M_PI), Eigen::Vector3f::UnitX());
  std::vector<KnownBody> bodies;
  bodies.emplace_back("link", cloud::boxSurface({0.2F, 0.1F, 0.1F}), 0.04F, true);
  scene.cloud_from_body.emplace_back(Eigen::Translation3f(-0.4F, 0, 1.9F));
  FinderSettings settings;
  settings.gap = 0.05F;
  ObjectFinder finder(std::move(bodies), settings);
  const Points points = pointsOf(cloud);
  const std::vector<Label> labels = finder.label(points, scene);
  freePart(cloud, labels);
  ObjectTracks tracks;
  tracks.update(0, finder.find(points, labels, scene));
  const auto objects = finder.find(points, labels, scene, tracks.predictedAt(0.03));
  const auto isHiddenHere = [&](const UprightBox& box) {
    return isHidden(box, points, labels, scene.global_from_cloud);
  };
  tracks.update(0.03, objects, isHiddenHere);
  tracks.update(0.06, {}, isHiddenHere);
  return objects.size();
}

void set(PointCloud2& cloud, std::mt19937& random, float value) {
  sensor_msgs::PointCloud2Iterator<float> place(cloud, "x");
  (place + static_cast<int>(random() % (kWidth * kHeight)))[static_cast<int>(random() % 3)] = value;
}

/// Changes one number of the cloud to an arbitrary value.
void mutate(PointCloud2& cloud, std::mt19937& random) {
  const std::uint32_t any[] = {0, 1, 3, 4, 5, 12, 31, 33, 128, 0x7FFFFFFF, 0xFFFFFFFF};
  sensor_msgs::PointField& field = cloud.fields[random() % cloud.fields.size()];
  std::uint32_t* const numbers[] = {&cloud.width, &cloud.height, &cloud.row_step, &cloud.point_step,
                                    &field.offset};
  switch (random() % 5) {
    case 0:
      field.datatype = random() % 10;
      break;
    case 1:
      cloud.data.resize(random() % (cloud.data.size() + 2));
      break;
    case 2:
      std::swap(cloud.fields.front(), cloud.fields[random() % cloud.fields.size()]);
      cloud.is_bigendian = random() % 4 == 0;
      break;
    default:
      *numbers[random() % std::size(numbers)] = any[random() % std::size(any)];
  }
}

TEST(BadObjects, TheGoodCloudHasOne) { EXPECT_EQ(countObjects(makeCloud()), 1U); }

TEST(BadObjects, AnyTwoChangesAreSurvived) {
  std::mt19937 random(9);
  int refused = 0, accepted = 0;
  for (int round = 0; round < 80; ++round) {
    PointCloud2 cloud = makeCloud();
    for (int change = 0; change < 2; ++change) mutate(cloud, random);
    try {
      countObjects(cloud);
      ++accepted;
    } catch (const std::invalid_argument&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 15);
  EXPECT_GT(accepted, 5);
}

TEST(BadObjects, AnyNumbersAreSurvived) {
  const float infinity = std::numeric_limits<float>::infinity();
  const float extremes[] = {NAN, infinity, -infinity, 3e38F, -3e38F, 1e-45F, 9e3F, -0.0F, 0};
  std::mt19937 random(11);
  for (int round = 0; round < 30; ++round) {
    PointCloud2 cloud = makeCloud();
    for (int change = 0; change < 100; ++change)
      set(cloud, random, extremes[random() % std::size(extremes)]);
    if (round % 2 == 1) {  // not in rows
      cloud.width = kWidth * kHeight;
      cloud.height = 1;
      cloud.row_step = static_cast<std::uint32_t>(cloud.data.size());
    }
    EXPECT_LT(countObjects(cloud), 10U);
  }
}

TEST(BadObjects, NaNEverywhereAndNoPointsAreNoObjects) {
  PointCloud2 cloud = makeCloud();
  for (sensor_msgs::PointCloud2Iterator<float> x(cloud, "x"); x != x.end(); ++x) *x = NAN;
  EXPECT_EQ(countObjects(cloud), 0U);
  cloud.width = cloud.row_step = 0;
  cloud.data.clear();
  EXPECT_EQ(countObjects(cloud), 0U);
  cloud.height = 0xFFFFFFFF;
  EXPECT_EQ(countObjects(cloud), 0U);
}

}  // namespace
}  // namespace process_visualizer::objects

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
