// SPDX-License-Identifier: BSD-3-Clause
/// A person who walks up to a robot and away again, as a Kinect sees it from the side.
///
/// usage: walk_in_clouds FILE.urdf FILE.clouds
/// The second file has for each cloud, ten a second, the angle of all joints (float, rad) and the
/// points x, y, z (float, m, NaN where nothing is measured) in rows, in the sensor's optical frame.
/// Prints the size of a picture, and the sensor's pose in the world: a matrix in rows.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <vector>

#include "objects_scene.hpp"
#include "sensed_scenes.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector3f;

constexpr float kRate = 10, kLength = 10;  // Hz, s

std::vector<std::uint8_t> readNothing(const std::string& /*name*/) { return {}; }

/// Returns the person's position along x, m: walks in, stands before the robot, and leaves.
float wayAt(float time) {
  const float far = 2.6F, near = 0.85F;
  const auto eased = [](float share) {
    const float it = std::clamp(share, 0.0F, 1.0F);
    return it * it * (3 - 2 * it);
  };
  return far + (near - far) * (eased((time - 0.5F) / 3) - eased((time - 6) / 3));
}

void write(const char* urdf_path, const char* clouds_path) {
  SensorModel sensor = kinect();
  sensor.width /= 2, sensor.height /= 2, sensor.focal /= 2;
  SensedWorld world(sensor, 3);
  const MovingRobot robot(sixJointRobot(), readNothing, Isometry3f::Identity());
  const Isometry3f pose = lookingFrom({0.9F, -2.6F, 2.3F}, {0.6F, 0, 0.6F});
  std::ofstream(urdf_path) << sixJointRobot();
  std::ofstream file(clouds_path, std::ios::binary);
  const auto put = [&](float value) {
    file.write(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (float number = 0; number < kRate * kLength; ++number) {
    const float time = number / kRate, turned = 0.4F * time, way = wayAt(time);
    world.begin(pose);
    world.draw({Solid::Kind::kBox, {9, 9, 0.1F}, Isometry3f(Eigen::Translation3f(0, 0, -0.05F))},
               0);
    for (const LinkGeometry& link : robot.links())
      world.draw(link.mesh, robot.poseOf(link.frame, turned), 1);
    const Isometry3f feet = Isometry3f(Eigen::Translation3f(way, 0.1F, 0)) *
                            Eigen::AngleAxisf(time < 5 ? 3.1416F : 0, Vector3f::UnitZ());
    for (const Solid& part : personAt(feet, 4.5F * way)) world.draw(part, 2);
    put(0.3F + std::asin(std::sin(turned)));
    for (const Vector3f& place : world.points().places)
      for (int axis = 0; axis < 3; ++axis) put(place[axis]);
  }
  std::printf("%d %d", sensor.width, sensor.height);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      std::printf(" %.6f", static_cast<double>(pose.matrix()(row, column)));
  std::printf("\n");
}

}  // namespace
}  // namespace process_visualizer::objects

int main(int argc, char** argv) {
  if (argc != 3) return 1;
  process_visualizer::objects::write(argv[1], argv[2]);
  return 0;
}
