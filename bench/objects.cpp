// SPDX-License-Identifier: BSD-3-Clause
/// Robots of a cell as a depth camera sees them while they move, taken out of its clouds, and
/// objects in what remains: how well, and in how much time.
///
/// usage: objects_benchmark FRAMES SPEED_RAD_PER_S DELAY_S URDF...
/// DELAY_S is by how much the robots' poses are older than the clouds.
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "../test/cpp/depth_camera.hpp"
#include "process_visualizer/objects/link_geometry.hpp"
#include "process_visualizer/objects/object_tracks.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector3f;

constexpr std::int8_t kTable = 0, kRobot = 1, kObject = 2;
constexpr double kRate = 30;  // Hz

std::vector<std::uint8_t> readFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

Isometry3f toEigen(const urdf::Pose& pose) {
  double x, y, z, w;
  pose.rotation.getQuaternion(x, y, z, w);
  return Eigen::Translation3f(static_cast<float>(pose.position.x),
                              static_cast<float>(pose.position.y),
                              static_cast<float>(pose.position.z)) *
         Eigen::Quaterniond(w, x, y, z).cast<float>();
}

/// A robot whose joints all turn to and fro, each with the given speed.
class MovingRobot {
 public:
  /// \param urdf  with absolute paths of meshes
  MovingRobot(const std::string& urdf, const Isometry3f& base)
      : model_(urdf::parseURDF(urdf)), links_(linkGeometries(urdf, readFile)), base_(base) {}

  const std::vector<LinkGeometry>& links() const { return links_; }

  Isometry3f poseOf(const std::string& link, double angle) const {
    const urdf::LinkConstSharedPtr found = model_->getLink(link);
    if (!found->parent_joint) return base_;
    const urdf::Joint& joint = *found->parent_joint;
    Isometry3f pose =
        poseOf(joint.parent_link_name, angle) * toEigen(joint.parent_to_joint_origin_transform);
    if (joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS)
      pose = pose * Eigen::AngleAxisf(
                        static_cast<float>(angle),
                        Vector3f(static_cast<float>(joint.axis.x), static_cast<float>(joint.axis.y),
                                 static_cast<float>(joint.axis.z)));
    return pose;
  }

 private:
  urdf::ModelInterfaceSharedPtr model_;
  std::vector<LinkGeometry> links_;
  Isometry3f base_;
};

/// Something in the cell that moves on a circle, m.
struct MovingObject {
  Vector3f size, center;
  float radius, speed;  ///< rad/s

  Isometry3f poseAt(double time) const {
    const float angle = speed * static_cast<float>(time);
    return Eigen::Translation3f(center + radius * Vector3f(std::cos(angle), std::sin(angle), 0)) *
           Eigen::AngleAxisf(angle, Vector3f::UnitZ());
  }
};

const std::vector<MovingObject> kObjects{{{0.30F, 0.20F, 0.15F}, {-0.65F, -0.35F, 0.075F}, 0, 0},
                                         {{0.12F, 0.20F, 0.06F}, {-0.60F, 0.35F, 0.30F}, 0.15F, 1},
                                         {{0.20F, 0.20F, 0.20F}, {0.70F, -0.45F, 0.10F}, 0, 0},
                                         {{0.10F, 0.10F, 0.30F}, {0.80F, 0.30F, 0.15F}, 0.1F, -1},
                                         {{0.25F, 0.15F, 0.10F}, {0.15F, 0.60F, 0.05F}, 0, 0}};

struct Figures {
  long robot = 0, missed = 0, others = 0, taken = 0, false_objects = 0, seen = 0, exchanged = 0;
  double label_s = 0, find_s = 0, track_s = 0;
  std::vector<float> size_errors;                ///< of edges of objects that stand on the table, m
  std::map<std::size_t, std::uint32_t> numbers;  ///< of objects, as they were last
};

/// Processor time, s, which other programs do not change.
double since(std::clock_t begin) {
  return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

void count(Figures& figures, const DepthCamera& camera, const std::vector<Label>& labels) {
  for (std::size_t pixel = 0; pixel < labels.size(); ++pixel) {
    const std::int8_t thing = camera.things()[pixel];
    if (thing < 0) continue;  // nothing, or made up
    const bool is_free = labels[pixel] == Label::kFree;
    if (thing == kRobot) {
      ++figures.robot;
      figures.missed += is_free ? 1 : 0;
    } else {
      ++figures.others;
      figures.taken += is_free ? 0 : 1;
    }
  }
}

void compareSize(Figures& figures, const MovingObject& object, Vector3f size) {
  if (object.center.z() > object.size.z()) return;  // it hovers: its lower side is not seen
  Vector3f expected = object.size;
  std::sort(size.data(), size.data() + 2);
  std::sort(expected.data(), expected.data() + 2);
  for (int axis = 0; axis < 3; ++axis)
    figures.size_errors.push_back(std::abs(size[axis] - expected[axis]));
}

void compare(Figures& figures, const std::vector<TrackedObject>& tracked, double time) {
  for (const TrackedObject& it : tracked) {
    const Vector3f& center = it.object.box.center;
    std::size_t nearest = 0;
    const auto away = [&](std::size_t object) {
      return (kObjects[object].poseAt(time).translation() - center).norm();
    };
    for (std::size_t object = 1; object < kObjects.size(); ++object)
      if (away(object) < away(nearest)) nearest = object;
    if (!it.is_seen) continue;
    if (away(nearest) > 0.15F) {
      ++figures.false_objects;
      continue;
    }
    ++figures.seen;
    compareSize(figures, kObjects[nearest], it.object.box.size);
    const auto [known, is_new] = figures.numbers.emplace(nearest, it.number);
    if (!is_new && known->second != it.number) ++figures.exchanged;
    known->second = it.number;
  }
}

void print(const Figures& it, int frames) {
  const auto percent = [](long part, long whole) { return 100.0 * part / std::max(whole, 1L); };
  std::printf("| points on robots taken out | %.2f %% of %ld |\n",
              100 - percent(it.missed, it.robot), it.robot);
  std::printf("| other points taken out | %.2f %% of %ld |\n", percent(it.taken, it.others),
              it.others);
  std::printf("| objects seen of %zu | %.2f |\n", kObjects.size(), 1.0 * it.seen / frames);
  std::printf("| objects that are none | %ld |\n", it.false_objects);
  std::vector<float> errors = it.size_errors;
  std::sort(errors.begin(), errors.end());
  std::printf("| error of sizes, 99 of 100 | %.1f mm |\n", 1000 * errors[errors.size() * 99 / 100]);
  std::printf("| exchanged numbers in %d frames | %ld |\n", frames, it.exchanged);
  std::printf("| per cloud: models taken out | %.1f ms |\n", 1000 * it.label_s / frames);
  std::printf("| per cloud: planes, objects, distances | %.1f ms |\n", 1000 * it.find_s / frames);
  std::printf("| per cloud: numbers | %.2f ms |\n", 1000 * it.track_s / frames);
}

/// The cell, frame by frame.
class Benchmark {
 public:
  /// \param delay  by how much the poses of robots are older than clouds, s
  Benchmark(std::vector<MovingRobot> robots, double speed, double delay)
      : robots_(std::move(robots)), finder_(bodiesOf(robots_), {}), speed_(speed), delay_(delay) {}

  void step(Figures& figures, double time) {
    DepthCamera camera = picture(time);
    const Points points = camera.points(random_);
    const Scene scene = sceneAt(time);
    std::clock_t begin = std::clock();
    const std::vector<Label> labels = finder_.label(points, scene);
    figures.label_s += since(begin);
    begin = std::clock();
    const std::vector<FoundObject> found = finder_.find(points, labels, scene);
    figures.find_s += since(begin);
    begin = std::clock();
    const std::vector<TrackedObject> tracked = tracks_.update(time, found);
    figures.track_s += since(begin);
    count(figures, camera, labels);
    compare(figures, tracked, time);
  }

 private:
  static std::vector<KnownBody> bodiesOf(const std::vector<MovingRobot>& robots) {
    const std::clock_t begin = std::clock();
    std::vector<KnownBody> bodies;
    for (const MovingRobot& robot : robots)
      for (const LinkGeometry& link : robot.links())
        bodies.emplace_back(link.frame, link.mesh, FinderSettings().padding + 0.01F, true);
    std::printf("| %zu links prepared in | %.1f s |\n", bodies.size(), since(begin));
    return bodies;
  }

  /// Of all joints: to and fro.
  double angleAt(double time) const { return 0.3 + std::asin(std::sin(speed_ * time)); }

  DepthCamera picture(double time) const {
    DepthCamera camera(camera_pose_);
    camera.draw(cloud::boxSurface({4, 4, 0.1F}), Isometry3f(Eigen::Translation3f(0, 0, -0.05F)),
                kTable);
    for (const MovingRobot& robot : robots_)
      for (const LinkGeometry& link : robot.links())
        camera.draw(link.mesh, robot.poseOf(link.frame, angleAt(time)), kRobot);
    for (const MovingObject& object : kObjects)
      camera.draw(cloud::boxSurface(object.size), object.poseAt(time), kObject);
    return camera;
  }

  Scene sceneAt(double time) const {
    Scene scene;
    scene.global_from_cloud = camera_pose_;
    for (const MovingRobot& robot : robots_)
      for (const LinkGeometry& link : robot.links())
        scene.cloud_from_body.push_back(camera_pose_.inverse() *
                                        robot.poseOf(link.frame, angleAt(time - delay_)));
    return scene;
  }

  const Isometry3f camera_pose_ = lookingDown({0.1F, 0, 2.2F});
  std::vector<MovingRobot> robots_;
  ObjectFinder finder_;
  ObjectTracks tracks_;
  std::mt19937 random_{1};
  double speed_, delay_;
};

MovingRobot readRobot(const char* path, float x) {
  const std::vector<std::uint8_t> urdf = readFile(path);
  return {std::string(urdf.begin(), urdf.end()), Isometry3f(Eigen::Translation3f(x, 0, 0.05F))};
}

}  // namespace
}  // namespace process_visualizer::objects

int main(int argc, char** argv) {
  using namespace process_visualizer::objects;
  if (argc < 5) return 1;
  const int frames = std::atoi(argv[1]);
  std::vector<MovingRobot> robots;
  for (int number = 4; number < argc; ++number)
    robots.push_back(readRobot(argv[number], 0.5F * static_cast<float>(number - 4)));
  Benchmark benchmark(std::move(robots), std::atof(argv[2]), std::atof(argv[3]));
  Figures figures;
  for (int frame = 0; frame < frames; ++frame) benchmark.step(figures, frame / kRate);
  print(figures, frames);
  return 0;
}
