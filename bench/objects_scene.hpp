// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "../test/cpp/depth_camera.hpp"
#include "process_visualizer/objects/known_bodies.hpp"

namespace process_visualizer::objects {

inline Eigen::Isometry3f toEigen(const urdf::Pose& pose) {
  double x, y, z, w;
  pose.rotation.getQuaternion(x, y, z, w);
  return Eigen::Translation3f(static_cast<float>(pose.position.x),
                              static_cast<float>(pose.position.y),
                              static_cast<float>(pose.position.z)) *
         Eigen::Quaterniond(w, x, y, z).cast<float>();
}

/// A robot whose joints all turn back and forth, each with the same speed.
class MovingRobot {
 public:
  /// \param urdf  with absolute paths of meshes
  MovingRobot(const std::string& urdf, const ReadResource& read, const Eigen::Isometry3f& base)
      : model_(urdf::parseURDF(urdf)), links_(linkGeometries(urdf, read)), base_(base) {}

  const std::vector<LinkGeometry>& links() const { return links_; }

  /// Lets each joint begin at a random phase.
  void drawPhases(std::mt19937& random) {
    std::uniform_real_distribution<double> phase(0, 2 * M_PI);
    for (const auto& [name, joint] : model_->joints_) phases_[name] = phase(random);
  }

  /// \param turned  angle by which each joint has turned since the beginning, rad
  Eigen::Isometry3f poseOf(const std::string& link, double turned) const {
    const urdf::LinkConstSharedPtr found = model_->getLink(link);
    if (!found->parent_joint) return base_;
    const urdf::Joint& joint = *found->parent_joint;
    const Eigen::Isometry3f pose =
        poseOf(joint.parent_link_name, turned) * toEigen(joint.parent_to_joint_origin_transform);
    if (joint.type != urdf::Joint::REVOLUTE && joint.type != urdf::Joint::CONTINUOUS) return pose;
    const auto phase = phases_.find(joint.name);
    const double begin = phase == phases_.end() ? 0 : phase->second;
    return pose * Eigen::AngleAxisf(
                      static_cast<float>(0.3 + std::asin(std::sin(begin + turned))),
                      Eigen::Vector3d(joint.axis.x, joint.axis.y, joint.axis.z).cast<float>());
  }

 private:
  urdf::ModelInterfaceSharedPtr model_;
  std::vector<LinkGeometry> links_;
  std::map<std::string, double> phases_;  ///< of joints by their names, rad
  Eigen::Isometry3f base_;
};

/// A board that a robot carries back and forth over the whole table, 1.3 m below the camera. It
/// hides each object for about 0.5 to 1 s.
struct Board {
  Eigen::Vector3f size{0.36F, 1.2F, 0.02F};

  Eigen::Isometry3f poseAt(double time) const {
    const double way = std::asin(std::sin(0.3 * time)) / M_PI_2;  // from -1 to 1
    return Eigen::Isometry3f(Eigen::Translation3f(0.1F + 1.1F * static_cast<float>(way), 0, 0.9F));
  }
};

/// Something in the cell that moves on a circle, m.
struct MovingObject {
  Eigen::Vector3f size, center;
  float radius, speed;  ///< rad/s
  float phase = 0;      ///< rad

  Eigen::Isometry3f poseAt(double time) const {
    const float angle = phase + speed * static_cast<float>(time);
    return Eigen::Translation3f(center +
                                radius * Eigen::Vector3f(std::cos(angle), std::sin(angle), 0)) *
           Eigen::AngleAxisf(angle, Eigen::Vector3f::UnitZ());
  }

  bool stands() const { return center.z() <= size.z(); }

  /// Returns the greatest distance from its center that it reaches on its way, m.
  float reach() const { return radius + size.head<2>().norm() / 2; }
};

/// Five objects, two of which move.
inline std::vector<MovingObject> firstObjects() {
  return {{{0.30F, 0.20F, 0.15F}, {-0.65F, -0.35F, 0.075F}, 0, 0},
          {{0.12F, 0.20F, 0.06F}, {-0.60F, 0.35F, 0.30F}, 0.15F, 1},
          {{0.20F, 0.20F, 0.20F}, {0.70F, -0.45F, 0.10F}, 0, 0},
          {{0.10F, 0.10F, 0.30F}, {0.80F, 0.30F, 0.15F}, 0.1F, -1},
          {{0.25F, 0.15F, 0.10F}, {0.15F, 0.60F, 0.05F}, 0, 0}};
}

/// Objects like these at random positions beside the robots' bases, at least 10 cm apart; one of
/// those that move hovers.
inline std::vector<MovingObject> drawnObjects(std::mt19937& random) {
  const auto between = [&](float least, float most) {
    return std::uniform_real_distribution<float>(least, most)(random);
  };
  std::vector<MovingObject> objects;
  while (objects.size() < 5) {
    const bool moves = objects.size() % 2 == 1, hovers = objects.size() == 1;
    const Eigen::Vector3f size(between(0.1F, 0.3F), between(0.1F, 0.25F), between(0.06F, 0.25F));
    const MovingObject it{
        size,
        {between(-0.85F, 1.05F), between(-0.7F, 0.7F), size.z() / 2 + (hovers ? 0.25F : 0)},
        moves ? between(0.05F, 0.2F) : 0,
        moves ? between(0.4F, 1.2F) * (hovers ? 1 : -1) : 0,
        between(0, 6)};
    const auto isFree = [&](const MovingObject& other) {
      const float away = (it.center - other.center).head<2>().norm();
      return away > it.reach() + other.reach() + 0.1F;
    };
    const auto isBesideBase = [&](float x) {
      return (it.center.head<2>() - Eigen::Vector2f(x, 0)).norm() > it.reach() + 0.15F;
    };
    if (std::all_of(objects.begin(), objects.end(), isFree) && isBesideBase(0) &&
        isBesideBase(0.5F))
      objects.push_back(it);
  }
  return objects;
}

}  // namespace process_visualizer::objects
