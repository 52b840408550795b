// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "objects_scene.hpp"
#include "sensed_world.hpp"

namespace process_visualizer::objects {

/// An unmodeled thing in the cell at one time.
struct Thing {
  int number;  ///< a new one for each visit
  std::vector<Solid> solids;
  bool stands = false;  ///< a box on the floor that does not move
  float speed = 0;      ///< m/s
};

enum class SceneKind { kThings, kPerson, kFast };

inline const char* nameOf(SceneKind kind) {
  return kind == SceneKind::kThings ? "things" : kind == SceneKind::kPerson ? "person" : "fast";
}

/// The things in the cell over time, drawn from a seed: static things and some that move slowly; or
/// people who walk in and out; or a box that is thrown through, and a hand that reaches in.
class SensedScene {
 public:
  SensedScene(SceneKind kind, unsigned seed) : kind_(kind), random_(seed) {
    while (standing_.size() < 3) addStanding();
    for (float& it : draws_) it = between(0, 1);
  }

  std::vector<Thing> at(double time) const {
    std::vector<Thing> things = standing_;
    const auto t = static_cast<float>(time);
    switch (kind_) {
      case SceneKind::kThings:
        things.push_back(circling(t));
        break;
      case SceneKind::kPerson:
        addWalking(things, t, 0);
        addWalking(things, t, 1);
        break;
      case SceneKind::kFast:
        addThrown(things, t);
        addHand(things, t);
    }
    return things;
  }

 private:
  float between(float least, float most) {
    return std::uniform_real_distribution<float>(least, most)(random_);
  }

  static Eigen::Isometry3f placed(float x, float y, float z, float yaw) {
    return Eigen::Translation3f(x, y, z) * Eigen::AngleAxisf(yaw, Eigen::Vector3f::UnitZ());
  }

  void addStanding() {
    const float angle = between(0, 6.28F), away = between(0.75F, 1.25F);
    const float x = away * std::cos(angle), y = away * std::sin(angle);
    for (const Thing& it : standing_)
      if ((it.solids[0].pose.translation().head<2>() - Eigen::Vector2f(x, y)).norm() < 0.55F)
        return;
    const auto number = static_cast<int>(standing_.size());
    const Eigen::Vector3f size =
        number == 0 ? Eigen::Vector3f(between(0.2F, 0.4F), between(0.2F, 0.4F), 0.6F)
        : number == 1
            ? Eigen::Vector3f(0.1F, 0.1F, between(0.4F, 0.7F))
            : Eigen::Vector3f(between(0.1F, 0.3F), between(0.1F, 0.3F), between(0.08F, 0.25F));
    standing_.push_back(
        {number, {{Solid::Kind::kBox, size, placed(x, y, size.z() / 2, between(0, 3))}}, true, 0});
  }

  /// A ball on a circle around the robot's base.
  Thing circling(float t) const {
    const float speed = 0.3F + 0.7F * draws_[0], angle = 6.28F * draws_[1] + speed * t;
    const float size = 0.08F + 0.1F * draws_[2];
    return {10,
            {{Solid::Kind::kEllipsoid, Eigen::Vector3f::Constant(size),
              placed(1.45F * std::cos(angle), 1.45F * std::sin(angle), 0.3F, 0)}},
            false,
            1.45F * speed};
  }

  /// Walks along a line 0.8 m or more beside the robot, in and out of the cell, again and again.
  void addWalking(std::vector<Thing>& things, float t, int who) const {
    const float speed = 1.1F + 0.5F * draws_[who], way = 7.0F;
    const float passed = speed * t + way * draws_[2 + who];
    const int visit = static_cast<int>(passed / way);
    const float x = std::fmod(passed, way) - way / 2;
    const float y = (who == 0 ? 1 : -1) * (0.8F + 0.5F * draws_[4 + who]);
    const bool is_back = (visit + who) % 2 == 1;
    const Eigen::Isometry3f feet = placed(is_back ? -x : x, y, 0, is_back ? 3.1416F : 0.0F);
    things.push_back({100 + 100 * who + visit, personAt(feet, 4.5F * passed), false, speed});
  }

  /// A box of 15 cm crosses the cell at 1.5 to 3 m/s, every three seconds.
  void addThrown(std::vector<Thing>& things, float t) const {
    constexpr float kPeriod = 3;
    const int visit = static_cast<int>(t / kPeriod);
    const float speed = 1.5F + 1.5F * std::fmod(draws_[0] + 0.37F * static_cast<float>(visit), 1.F);
    const float x = speed * std::fmod(t, kPeriod) - 2.5F, size = 0.08F + 0.1F * draws_[1];
    const float y = (visit % 2 == 0 ? 1 : -1) * (0.6F + 0.5F * draws_[2]);
    if (x > 2.5F) return;
    things.push_back(
        {1000 + visit,
         {{Solid::Kind::kBox, {size, size, size}, placed(x, y, 0.35F + 0.4F * draws_[3], 0.5F)}},
         false,
         speed});
  }

  /// A hand and a forearm that reach in and out at 2 m/s.
  void addHand(std::vector<Thing>& things, float t) const {
    const float turn = 2.2F * t + 6.28F * draws_[4];
    const float x = 1.75F + 0.9F * std::cos(turn);  // of the hand
    if (x > 2.4F) return;
    const int visit = static_cast<int>((turn + 3.1416F) / 6.2832F);
    things.push_back({2000 + visit,
                      {{Solid::Kind::kEllipsoid, {0.18F, 0.09F, 0.05F}, placed(x, 0.1F, 0.6F, 0)},
                       {Solid::Kind::kCapsule,
                        {0.08F, 0.08F, 0.6F},
                        placed(x + 0.35F, 0.1F, 0.62F, 0) *
                            Eigen::Isometry3f(Eigen::AngleAxisf(1.57F, Eigen::Vector3f::UnitY()))}},
                      false,
                      1.98F});
  }

  SceneKind kind_;
  std::mt19937 random_;
  std::vector<Thing> standing_;
  float draws_[8] = {};
};

/// A robot of cylinders and boxes with six joints, 1.3 m high.
inline std::string sixJointRobot() {
  std::string text = "<robot name='arm'>";
  char part[600];
  const char* axes[] = {"0 0 1", "0 1 0", "0 1 0", "0 0 1", "0 1 0", "0 0 1"};
  const float heights[] = {0.25F, 0.15F, 0.45F, 0.2F, 0.25F, 0.1F};
  const float radii[] = {0.09F, 0.075F, 0.06F, 0.055F, 0.05F, 0.045F};
  const float lengths[] = {0.16F, 0.45F, 0.2F, 0.25F, 0.1F, 0.12F};
  std::snprintf(part, sizeof(part),
                "<link name='l0'><visual><origin xyz='0 0 0.12'/><geometry><cylinder radius='0.12' "
                "length='0.24'/></geometry></visual></link>");
  text += part;
  for (int joint = 0; joint < 6; ++joint) {
    std::snprintf(
        part, sizeof(part),
        "<link name='l%d'><visual><origin xyz='0 0 %f'/><geometry><%s/></geometry></visual></link>"
        "<joint name='j%d' type='continuous'><parent link='l%d'/><child link='l%d'/>"
        "<origin xyz='0 0 %f'/><axis xyz='%s'/></joint>",
        joint + 1, lengths[joint] / 2,
        (joint == 5 ? std::string("box size='0.14 0.08 0.12'")
                    : "cylinder radius='" + std::to_string(radii[joint]) + "' length='" +
                          std::to_string(lengths[joint]) + "'")
            .c_str(),
        joint, joint, joint + 1, heights[joint], axes[joint]);
    text += part;
  }
  return text + "</robot>";
}

enum class View { kAbove, kSlanted, kLow, kLink };

inline const char* nameOf(View view) {
  const char* names[] = {"above", "45°", "low", "on a link"};
  return names[static_cast<int>(view)];
}

/// Returns the pose of a sensor at a point that looks at another one.
inline Eigen::Isometry3f lookingFrom(const Eigen::Vector3f& from, const Eigen::Vector3f& to) {
  const Eigen::Vector3f z = (to - from).normalized();
  const Eigen::Vector3f up =
      std::abs(z.z()) > 0.99F ? Eigen::Vector3f::UnitX() : Eigen::Vector3f::UnitZ();
  const Eigen::Vector3f x = z.cross(up).normalized();
  Eigen::Isometry3f pose = Eigen::Isometry3f::Identity();
  pose.linear() << x, z.cross(x), z;
  pose.translation() = from;
  return pose;
}

}  // namespace process_visualizer::objects
