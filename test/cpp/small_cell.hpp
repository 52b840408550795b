// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>
#include <vector>

#include "depth_camera.hpp"
#include "process_visualizer/objects/object_finder.hpp"
#include "process_visualizer/objects/object_tracks.hpp"
#include "process_visualizer/objects/point_image.hpp"

namespace process_visualizer::objects {

enum Thing : std::int8_t { kTable, kRobot, kObject };

inline Eigen::Isometry3f at(const Eigen::Vector3f& place, float yaw = 0) {
  return Eigen::Translation3f(place) * Eigen::AngleAxisf(yaw, Eigen::Vector3f::UnitZ());
}

/// A robot of two links next to each other, above a table.
class Cell {
 public:
  Cell() {
    bodies_.emplace_back("upper_arm", cloud::boxSurface({0.8F, 0.12F, 0.12F}), 0.04F, true);
    bodies_.emplace_back("gripper", cloud::cylinderSurface({0.08F, 0.08F, 0.3F}), 0.04F, true);
  }

  /// \param yaw  of the robot about the origin
  void poseRobot(float yaw) {
    const Eigen::Isometry3f turned(Eigen::AngleAxisf(yaw, Eigen::Vector3f::UnitZ()));
    robot_ = {turned * at({0.4F, 0, 0.5F}), turned * at({0.8F, 0, 0.35F})};
  }

  void add(const Eigen::Vector3f& size, const Eigen::Isometry3f& pose) {
    objects_.emplace_back(size, pose);
  }
  void clear() { objects_.clear(); }

  DepthCamera picture() const {
    DepthCamera camera(Cell::camera());
    camera.draw(cloud::boxSurface({3, 3, 0.1F}), at({0, 0, -0.05F}), kTable);
    camera.draw(cloud::boxSurface({0.8F, 0.12F, 0.12F}), robot_[0], kRobot);
    camera.draw(cloud::cylinderSurface({0.08F, 0.08F, 0.3F}), robot_[1], kRobot);
    for (const auto& [size, pose] : objects_) camera.draw(cloud::boxSurface(size), pose, kObject);
    return camera;
  }

  Scene scene() const {
    Scene scene;
    scene.global_from_cloud = camera();
    for (const Eigen::Isometry3f& pose : robot_)
      scene.cloud_from_body.push_back(camera().inverse() * pose);
    return scene;
  }

  std::vector<FoundObject> find(std::mt19937& random) const {
    const Points points = picture().points(random);
    ObjectFinder finder(bodies_, FinderSettings());
    return finder.find(points, finder.label(points, scene()), scene());
  }

  /// Pose of the camera, which looks down.
  static Eigen::Isometry3f camera() { return lookingDown({0.1F, 0.05F, 1.85F}); }

  const std::vector<KnownBody>& bodies() const { return bodies_; }

 private:
  std::vector<KnownBody> bodies_;
  std::vector<Eigen::Isometry3f> robot_;
  std::vector<std::pair<Eigen::Vector3f, Eigen::Isometry3f>> objects_;
};

/// Finds objects in a cell and tracks them, cloud by cloud at 30 Hz.
class Follower {
 public:
  explicit Follower(const Cell& cell) : cell_(cell), finder_(cell.bodies(), FinderSettings()) {}

  std::vector<TrackedObject> next(std::mt19937& random) {
    const Points points = cell_.picture().points(random);
    const Scene scene = cell_.scene();
    const auto labels = finder_.label(points, scene);
    const auto found = finder_.find(points, labels, scene, tracks_.predictedAt(time_));
    const auto tracked = tracks_.update(time_, found, [&](const UprightBox& box) {
      return isHidden(box, points, labels, scene.global_from_cloud);
    });
    time_ += 1.0 / 30;
    return tracked;
  }

 private:
  const Cell& cell_;
  ObjectFinder finder_;
  ObjectTracks tracks_;
  double time_ = 0;
};

}  // namespace process_visualizer::objects
