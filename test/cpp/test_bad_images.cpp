// SPDX-License-Identifier: BSD-3-Clause
/// Invalid images and clouds. Built with AddressSanitizer and UndefinedBehaviorSanitizer.
#include <gtest/gtest.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "camera_images.hpp"
#include "process_visualizer/cloud/registered_crop.hpp"
#include "process_visualizer/cloud/roi_filter.hpp"
#include "process_visualizer/cloud/voxel_grid.hpp"

namespace process_visualizer::cloud {
namespace {

using Damage = std::function<void(CameraImages&)>;

const Box kBox({0, 0, 1.5}, {1, 1, 1});

sensor_msgs::PointCloud2 crop(const CameraImages& images) {
  // Copies without spare room, so that the sanitizer sees each byte read beyond the data.
  auto exact = images;
  exact.depth.data.shrink_to_fit();
  exact.color.data.shrink_to_fit();
  return RegisteredCrop(Lens::kDistorts)
      .crop(exact.depth, exact.color, exact.info, Eigen::Isometry3d::Identity(), kBox);
}

/// One kind of damage to valid images, and the text that the message must contain.
struct BadImages {
  std::string message;
  Damage damage;
};

const BadImages kBadImages[] = {
    {"depth image's encoding is 'rgb8'", [](auto& images) { images.depth.encoding = "rgb8"; }},
    {"depth image's encoding is ''", [](auto& images) { images.depth.encoding.clear(); }},
    {"color image's encoding is '16UC1'", [](auto& images) { images.color.encoding = "16UC1"; }},
    {"big-endian", [](auto& images) { images.depth.is_bigendian = true; }},
    {"depth image has no pixels", [](auto& images) { images.depth.width = 0; }},
    {"depth image has no pixels", [](auto& images) { images.depth.height = 0; }},
    {"color image has no pixels", [](auto& images) { images.color.width = 0; }},
    {"color image has no pixels", [](auto& images) { images.color.height = 0; }},
    {"depth image's step", [](auto& images) { --images.depth.step; }},
    {"depth image's step", [](auto& images) { images.depth.step = 0; }},
    {"depth image's step", [](auto& images) { images.depth.width = 0xFFFFFFFF; }},
    {"depth image's step", [](auto& images) { images.depth.encoding = "32FC1"; }},
    {"color image's step", [](auto& images) { --images.color.step; }},
    {"color image's step", [](auto& images) { images.color.encoding = "rgba8"; }},
    {"depth image's data is cut off", [](auto& images) { images.depth.data.pop_back(); }},
    {"depth image's data is cut off", [](auto& images) { images.depth.data.clear(); }},
    {"depth image's data is cut off", [](auto& images) { images.depth.height = 0xFFFFFFFF; }},
    {"depth image's data is cut off", [](auto& images) { images.depth.step = 0xFFFFFFFF; }},
    {"color image's data is cut off", [](auto& images) { images.color.data.pop_back(); }},
    {"color image's data is cut off", [](auto& images) { images.color.height = 0xFFFFFFFF; }},
    {"does not cover", [](auto& images) { --images.color.height; }},
    {"color image has the frame 'other'",
     [](auto& images) { images.color.header.frame_id = "other"; }},
    {"camera info has the frame 'other'",
     [](auto& images) { images.info.header.frame_id = "other"; }},
    {"focal lengths", [](auto& images) { images.info.P[0] = images.info.K[0] = 0; }},
    {"focal lengths", [](auto& images) { images.info.P[5] = 0; }},
    {"focal lengths", [](auto& images) { images.info.P[0] = -525; }},
    {"focal lengths", [](auto& images) { images.info.P[5] = NAN; }},
    {"focal lengths", [](auto& images) { images.info.P[0] = INFINITY; }},
    {"principal point", [](auto& images) { images.info.P[2] = NAN; }},
    {"width or height is zero", [](auto& images) { images.info.width = 0; }},
    {"more rows", [](auto& images) { images.info.height = 40; }},
    {"'fisheye' is not supported",
     [](auto& images) {
       images.info.D[0] = 0.1;
       images.info.distortion_model = "fisheye";
     }},
    {"1 distortion coefficients", [](auto& images) { images.info.D.assign(1, 0.1); }},
    {"not all finite", [](auto& images) { images.info.D[3] = NAN; }},
};

TEST(BadImages, AreRefusedWithASentence) {
  for (const BadImages& bad : kBadImages) {
    auto images = makeImages();
    bad.damage(images);
    try {
      crop(images);
      ADD_FAILURE() << "accepted, expected: " << bad.message;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(bad.message), std::string::npos) << error.what();
    }
  }
}

TEST(BadImages, GoodOnesAfterwardsAreCropped) {
  const auto images = makeImages();
  RegisteredCrop filter(Lens::kDistorts);
  const auto run = [&](const CameraImages& given) {
    return filter.crop(given.depth, given.color, given.info, Eigen::Isometry3d::Identity(), kBox);
  };
  const auto expected = run(images);
  for (const BadImages& bad : kBadImages) {
    auto damaged = images;
    bad.damage(damaged);
    EXPECT_THROW(run(damaged), std::invalid_argument);
    EXPECT_EQ(run(images), expected) << "after: " << bad.message;
  }
}

TEST(BadImages, NaNEverywhereGivesNoPoints) {
  auto images = makeImages("32FC1");
  for (int pixel = 0; pixel < 64 * 48; ++pixel)
    setDepth(images.depth, pixel % 64, pixel / 64, std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(crop(images).width, 0u);
}

TEST(BadImages, HugeAndDenormalNumbersGiveNoPoints) {
  auto images = makeImages("32FC1", "rgb8", 4, 3);
  const float extremes[] = {3e38f, -3e38f, 1e-45f, -0.0f};
  for (int pixel = 0; pixel < 12; ++pixel)
    setDepth(images.depth, pixel % 4, pixel / 4, extremes[pixel % 4]);
  EXPECT_EQ(crop(images).width, 0u);
}

TEST(BadImages, ATransformOfNaNKeepsNothing) {
  const auto images = makeImages();
  for (int place = 0; place < 12; ++place) {
    Eigen::Isometry3d nowhere = Eigen::Isometry3d::Identity();
    nowhere.matrix()(place % 3, place / 3) = NAN;
    EXPECT_EQ(RegisteredCrop(Lens::kDistorts)
                  .crop(images.depth, images.color, images.info, nowhere, kBox)
                  .width,
              0u);
  }
}

/// Changes one number of the messages to an arbitrary value.
void mutate(CameraImages& images, std::mt19937& generator) {
  const std::uint32_t any[] = {0, 1, 2, 47, 63, 64, 65, 128, 0x7FFFFFFF, 0xFFFFFFFF};
  const double numbers[] = {0, -1, 1e-300, 1e300, NAN, INFINITY, 0.3};
  std::uint32_t* const sizes[] = {
      &images.depth.width,       &images.depth.height,      &images.depth.step,
      &images.color.width,       &images.color.height,      &images.color.step,
      &images.info.width,        &images.info.height,       &images.info.binning_x,
      &images.info.roi.x_offset, &images.info.roi.y_offset, &images.info.roi.width};
  double* const values[] = {&images.info.P[0], &images.info.P[2], &images.info.P[6],
                            &images.info.K[0], &images.info.D[0], &images.info.D[2]};
  switch (generator() % 3) {
    case 0:
      *sizes[generator() % std::size(sizes)] = any[generator() % std::size(any)];
      break;
    case 1:
      *values[generator() % std::size(values)] = numbers[generator() % std::size(numbers)];
      break;
    default:
      auto& data = generator() % 2 == 0 ? images.depth.data : images.color.data;
      data.resize(generator() % (data.size() + 2));
  }
}

TEST(BadImages, AnyThreeChangesAreSurvived) {
  std::mt19937 generator(7);
  const auto good = makeImages();
  int refused = 0, accepted = 0;
  for (int round = 0; round < 3000; ++round) {
    auto images = good;
    for (int change = 0; change < 3; ++change) mutate(images, generator);
    try {
      crop(images);
      ++accepted;
    } catch (const std::invalid_argument&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 300);
  EXPECT_GT(accepted, 30);
}

/// A cloud of 4 x 3 points with x, y, z and rgb, all of them in the box.
sensor_msgs::PointCloud2 makeCloud() {
  sensor_msgs::PointCloud2 cloud;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(2, "xyz", "rgb");
  modifier.resize(12);
  for (sensor_msgs::PointCloud2Iterator<float> z(cloud, "z"); z != z.end(); ++z) *z = 1.5f;
  cloud.width = 4;
  cloud.height = 3;
  cloud.row_step = 4 * cloud.point_step;
  return cloud;
}

/// Changes one number of the cloud to an arbitrary value.
void mutate(sensor_msgs::PointCloud2& cloud, std::mt19937& generator) {
  const std::uint32_t any[] = {0, 1, 3, 4, 5, 12, 31, 32, 33, 128, 0x7FFFFFFF, 0xFFFFFFFF};
  sensor_msgs::PointField& field = cloud.fields[generator() % cloud.fields.size()];
  std::uint32_t* const numbers[] = {&cloud.width, &cloud.height, &cloud.row_step, &cloud.point_step,
                                    &field.offset};
  switch (generator() % 4) {
    case 0:
      field.datatype = generator() % 10;
      break;
    case 1:
      cloud.data.resize(generator() % (cloud.data.size() + 2));
      break;
    default:
      *numbers[generator() % std::size(numbers)] = any[generator() % std::size(any)];
  }
}

TEST(BadClouds, AnyTwoChangesAreSurvived) {
  std::mt19937 generator(9);
  int refused = 0, accepted = 0;
  for (int round = 0; round < 3000; ++round) {
    auto cloud = makeCloud();
    for (int change = 0; change < 2; ++change) mutate(cloud, generator);
    cloud.data.shrink_to_fit();
    try {
      cropToBox(cloud, Eigen::Isometry3d::Identity(), kBox);
      VoxelGrid(0.01).add(cloud, Eigen::Isometry3d::Identity());
      ++accepted;
    } catch (const std::invalid_argument&) {
      EXPECT_THROW(VoxelGrid(0.01).add(cloud, Eigen::Isometry3d::Identity()),
                   std::invalid_argument);
      ++refused;
    }
  }
  EXPECT_GT(refused, 300);
  EXPECT_GT(accepted, 30);
}

TEST(BadClouds, PointsThatNoVoxelHoldsAreLeftOut) {
  for (const float extreme : {NAN, INFINITY, -INFINITY, 3e38f, -3e38f, 1e5f}) {
    auto cloud = makeCloud();
    sensor_msgs::PointCloud2Iterator<float> y(cloud, "y");
    *y = extreme;
    VoxelGrid grid(0.01);
    grid.add(cloud, Eigen::Isometry3d::Identity());
    EXPECT_EQ(grid.cloud({}).width, 1u) << extreme;
  }
}

}  // namespace
}  // namespace process_visualizer::cloud

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
