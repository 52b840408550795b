// SPDX-License-Identifier: BSD-3-Clause
/// A renderer of depth clouds that shares nothing with bench/sensed_world.hpp, and an evaluation of
/// the finder's results. Shapes are analytic; only public headers of the finder are used.
///
/// usage: other_scenes_benchmark [--scene a,b,…] [--sensor kinect,realsense,tof] [--hz 5,10,30]
///        [--seed 1,2] [--learn 0,1] [--seconds 8] [--dump]
///
/// Frames: global, z up, robot's base near the origin. Camera: z forward, x right, y down.
/// m, s, rad throughout.
#include <time.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "process_visualizer/objects/object_finder.hpp"
#include "process_visualizer/objects/object_tracks.hpp"

namespace pv = process_visualizer;
using namespace pv::objects;
using V = Eigen::Vector3f;
using pv::cloud::append;
using Pose = Eigen::Isometry3f;
using Rng = std::mt19937;
constexpr float kPi = 3.14159265F;
constexpr float kFar = 1e9F;

float uniform(Rng& rng, float a, float b) {
  return std::uniform_real_distribution<float>(a, b)(rng);
}
float gauss(Rng& rng) { return std::normal_distribution<float>()(rng); }

// ---------------------------------------------------------------- shapes

/// A box, cylinder, capsule (both along z) and sphere about their pose.
struct Shape {
  enum Kind { kBox, kCylinder, kCapsule, kSphere } kind;
  Pose pose;
  V half;  ///< of a box; else radius, radius, half of the length of the axis
  float reach() const {
    return kind == kBox || kind == kCylinder ? half.norm()
                                             : half.x() + half.z() * (kind == kCapsule);
  }
};

Pose at(const V& place, float yaw = 0) {
  return Eigen::Translation3f(place) * Eigen::Isometry3f(Eigen::AngleAxisf(yaw, V::UnitZ()));
}
Shape box(const Pose& pose, const V& size) { return {Shape::kBox, pose, size / 2}; }
Shape cylinder(const Pose& pose, float radius, float height) {
  return {Shape::kCylinder, pose, {radius, radius, height / 2}};
}
Shape sphere(const V& center, float radius) {
  return {Shape::kSphere, at(center), {radius, radius, 0}};
}
Shape capsule(const V& a, const V& b, float radius) {
  Pose pose = Pose::Identity();
  pose.translation() = (a + b) / 2;
  if ((b - a).norm() > 1e-6F)
    pose.linear() = Eigen::Quaternionf::FromTwoVectors(V::UnitZ(), b - a).toRotationMatrix();
  return {Shape::kCapsule, pose, {radius, radius, (b - a).norm() / 2}};
}

/// Least positive root of |o + t d - c|² = r² (d of any length), or kFar.
float hitSphere(const V& o, const V& d, const V& c, float r) {
  const V w = o - c;
  const float a = d.squaredNorm(), b = w.dot(d), q = b * b - a * (w.squaredNorm() - r * r);
  if (q < 0) return kFar;
  const float t = (-b - std::sqrt(q)) / a;
  return t > 1e-4F ? t : kFar;
}

/// Returns where a ray enters a shape (parameter of d), or kFar. An origin inside does not hit it.
float hit(const Shape& s, const V& origin, const V& direction) {
  const V o = s.pose.linear().transpose() * (origin - s.pose.translation());
  const V d = s.pose.linear().transpose() * direction;
  if (s.kind == Shape::kSphere) return hitSphere(o, d, V::Zero(), s.half.x());
  if (s.kind == Shape::kBox) {
    float in = -kFar, out = kFar;
    for (int i = 0; i < 3; ++i) {
      if (std::abs(d[i]) < 1e-9F) {
        if (std::abs(o[i]) > s.half[i]) return kFar;
        continue;
      }
      const float t1 = (-s.half[i] - o[i]) / d[i], t2 = (s.half[i] - o[i]) / d[i];
      in = std::max(in, std::min(t1, t2));
      out = std::min(out, std::max(t1, t2));
    }
    return in < out && in > 1e-4F ? in : kFar;
  }
  const float r = s.half.x(), h = s.half.z();
  float best = kFar;
  const float a = d.head<2>().squaredNorm(), b = o.head<2>().dot(d.head<2>()),
              q = b * b - a * (o.head<2>().squaredNorm() - r * r);
  if (a > 1e-12F && q >= 0) {
    const float t = (-b - std::sqrt(q)) / a;
    if (t > 1e-4F && std::abs(o.z() + t * d.z()) <= h) best = t;
  }
  for (const float side : {-h, h}) {
    if (s.kind == Shape::kCapsule) {
      best = std::min(best, hitSphere(o, d, V(0, 0, side), r));
    } else if (std::abs(d.z()) > 1e-9F) {
      const float t = (side - o.z()) / d.z();
      if (t > 1e-4F && (o + t * d).head<2>().norm() <= r) best = std::min(best, t);
    }
  }
  return best;
}

/// Signed distance (negative inside).
float distance(const Shape& s, const V& place) {
  const V p = s.pose.linear().transpose() * (place - s.pose.translation());
  if (s.kind == Shape::kSphere) return p.norm() - s.half.x();
  if (s.kind == Shape::kCapsule)
    return (p - V(0, 0, std::clamp(p.z(), -s.half.z(), s.half.z()))).norm() - s.half.x();
  if (s.kind == Shape::kBox) {
    const V q = p.cwiseAbs() - s.half;
    return q.cwiseMax(0).norm() + std::min(0.0F, q.maxCoeff());
  }
  const Eigen::Vector2f q(p.head<2>().norm() - s.half.x(), std::abs(p.z()) - s.half.z());
  return q.cwiseMax(0).norm() + std::min(0.0F, q.maxCoeff());
}

// ---------------------------------------------------------------- things

enum class Role { kRobot, kModel, kSurface, kFixture, kIntruder };

/// A part of the world. Fixtures (walls, fence, shelf) and intruders are unmodeled.
struct Thing {
  std::string name;
  Role role;
  std::function<std::vector<Shape>(double)> shapes;
  double from = -1e9, to = 1e9;  ///< s: period in which it is present
  bool still = true;
  V size = V::Zero();  ///< of a box whose size is to be evaluated
  bool isThere(double t) const { return t >= from && t < to; }
  bool isUnmodeled() const { return role == Role::kFixture || role == Role::kIntruder; }
};

Thing fixed(const std::string& name, Role role, std::vector<Shape> shapes) {
  return {name, role, [shapes](double) { return shapes; }};
}

/// A person of fifteen parts who walks straight lines between positions, and stands at their ends.
struct Walk {
  std::vector<Eigen::Vector2f> stops;
  float speed, pause, height;
  double start;
  double length() const {
    double sum = 0;
    for (size_t i = 1; i < stops.size(); ++i)
      sum += (stops[i] - stops[i - 1]).norm() / speed + pause;
    return sum;
  }
  struct State {
    Eigen::Vector2f place;
    float yaw, stride;
  };
  State at(double t) const {
    double left = t - start;
    float gone = 0;
    State s{stops.front(), 0, 0};
    for (size_t i = 1; i < stops.size(); ++i) {
      const Eigen::Vector2f way = stops[i] - stops[i - 1];
      const double needs = way.norm() / speed;
      s.yaw = std::atan2(way.y(), way.x());
      if (left < needs) {
        s.place = stops[i - 1] + way * static_cast<float>(std::max(0.0, left) / needs);
        gone += speed * static_cast<float>(std::max(0.0, left));
        s.stride = std::sin(2 * kPi * gone / (0.8F * height));
        return s;
      }
      left -= needs;
      gone += way.norm();
      s.place = stops[i];
      if (left < pause) return s;
      left -= pause;
    }
    return s;
  }
};

std::vector<Shape> person(const Walk& walk, double t, float lift_arm) {
  const Walk::State s = walk.at(t);
  const float k = walk.height / 1.75F;
  const Pose body = at({s.place.x(), s.place.y(), 0}, s.yaw);
  std::vector<Shape> parts;
  const auto limb = [&](const V& a, const V& b, float r) {
    parts.push_back(capsule(body * V(k * a), body * V(k * b), k * r));
  };
  limb({0, -.08F, .95F}, {0, .08F, .95F}, .13F);                     // pelvis
  limb({0, -.10F, 1.22F}, {0, .10F, 1.22F}, .14F);                   // chest
  parts.push_back(sphere(body * V(k * V(0, 0, 1.63F)), k * .115F));  // head
  for (const float side : {-1.F, 1.F}) {
    const float leg = .45F * s.stride * side,
                arm = -.5F * s.stride * side + (side > 0 ? lift_arm : 0);
    const V hip(0, .09F * side, .9F), knee = hip + V(std::sin(leg), 0, -std::cos(leg)) * .43F;
    const float bend = leg - .25F * std::abs(s.stride);
    const V ankle = knee + V(std::sin(bend), 0, -std::cos(bend)) * .41F;
    limb(hip, knee, .075F);
    limb(knee, ankle, .05F);
    limb(ankle + V(-.04F, 0, -.02F), ankle + V(.14F, 0, -.02F), .04F);
    const V shoulder(0, .21F * side, 1.40F),
        elbow = shoulder + V(std::sin(arm), 0, -std::cos(arm)) * .3F;
    const float fore = arm + .3F;
    const V wrist = elbow + V(std::sin(fore), 0, -std::cos(fore)) * .26F;
    limb(shoulder, elbow, .048F);
    limb(elbow, wrist, .04F);
    limb(wrist, wrist + V(std::sin(fore), 0, -std::cos(fore)) * .12F, .042F);
  }
  return parts;
}

// ---------------------------------------------------------------- the robot

/// Six joints, capsules and a box; its links as shapes (ground truth) and as meshes (input of the
/// finder).
struct Robot {
  Pose base;
  float pace = 1;
  std::array<float, 6> phase{};

  struct Link {
    std::vector<Shape> local;
    Pose pose;
  };
  static std::vector<std::vector<Shape>> shapes() {
    return {{cylinder(at({0, 0, .1F}), .11F, .2F)},     {capsule({0, 0, 0}, {0, 0, .16F}, .09F)},
            {capsule({0, 0, 0}, {0, 0, .45F}, .07F)},   {capsule({0, 0, 0}, {0, 0, .40F}, .055F)},
            {capsule({0, 0, 0}, {0, 0, .10F}, .05F)},   {capsule({0, 0, 0}, {0, 0, .10F}, .045F)},
            {box(at({0, 0, .06F}), {.08F, .14F, .12F})}};
  }
  std::vector<Pose> poses(double t) const {
    const auto q = [&](int i, float middle, float swing, float rate) {
      return middle + swing * static_cast<float>(std::sin(pace * rate * t + phase[i]));
    };
    const auto turn = [](float angle, const V& axis) {
      return Pose(Eigen::AngleAxisf(angle, axis));
    };
    const auto up = [](float z) { return Pose(Eigen::Translation3f(0, 0, z)); };
    std::vector<Pose> p{base};
    p.push_back(p.back() * up(.2F) * turn(q(0, 0, 1.2F, .5F), V::UnitZ()));
    p.push_back(p.back() * up(.16F) * turn(q(1, .45F, .4F, .7F), V::UnitY()));
    p.push_back(p.back() * up(.45F) * turn(q(2, 1.1F, .45F, .9F), V::UnitY()));
    p.push_back(p.back() * up(.40F) * turn(q(3, .7F, .5F, 1.1F), V::UnitY()));
    p.push_back(p.back() * up(.12F) * turn(q(4, 0, .8F, .8F), V::UnitX()));
    p.push_back(p.back() * up(.12F) * turn(q(5, 0, 1, .6F), V::UnitZ()));
    return p;
  }
  std::vector<Shape> posed(double t) const {
    std::vector<Shape> all;
    const auto links = shapes();
    const auto at_t = poses(t);
    for (size_t i = 0; i < links.size(); ++i)
      for (Shape s : links[i]) {
        s.pose = at_t[i] * s.pose;
        all.push_back(s);
      }
    return all;
  }
};

pv::cloud::Surface meshOf(const std::vector<Shape>& shapes) {
  pv::cloud::Surface mesh;
  for (const Shape& s : shapes) {
    const Eigen::Affine3f pose(s.pose.matrix());
    const V d = 2 * s.half;
    if (s.kind == Shape::kBox) append(mesh, pv::cloud::boxSurface(d), pose);
    if (s.kind == Shape::kCylinder || s.kind == Shape::kCapsule)
      append(mesh, pv::cloud::cylinderSurface(d), pose);
    if (s.kind == Shape::kSphere) append(mesh, pv::cloud::sphereSurface(V::Constant(d.x())), pose);
    if (s.kind == Shape::kCapsule)
      for (const float side : {-1.F, 1.F})
        append(mesh, pv::cloud::sphereSurface(V::Constant(d.x())),
               pose * Eigen::Translation3f(0, 0, side * s.half.z()));
  }
  return mesh;
}

// ---------------------------------------------------------------- scenes

struct World {
  std::vector<Thing> things;
  Robot robot;
  Pose sensor;    ///< camera in the global frame, true
  Pose believed;  ///< as given to the finder
  pv::cloud::Box region{Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(4, 4, 2.5)};
  double covered_from = 1e9;     ///< s: something lies on the lens
  float covered_at = 0.05F;      ///< m, or NaN
  std::vector<int> body_things;  ///< of models other than robots, in order of the bodies
};

Pose lookAt(const V& from, const V& to) {
  Pose pose = Pose::Identity();
  const V z = (to - from).normalized();
  V x = z.cross(V::UnitZ());
  if (x.norm() < 1e-3F) x = V::UnitX();
  x.normalize();
  pose.linear() << x, z.cross(x), z;
  pose.translation() = from;
  return pose;
}

void addTable(World& w, const std::string& name, const V& top_center, float yaw, const V& size,
              Role top, Role legs) {
  const Pose pose = at(top_center, yaw);
  w.things.push_back(fixed(name, top, {box(pose * at({0, 0, -size.z() / 2}), size)}));
  std::vector<Shape> posts;
  const float h = top_center.z() - size.z();
  for (const float x : {-1.F, 1.F})
    for (const float y : {-1.F, 1.F})
      posts.push_back(
          box(pose * at({x * (size.x() / 2 - .05F), y * (size.y() / 2 - .05F), -size.z() - h / 2}),
              {.05F, .05F, h}));
  w.things.push_back(fixed(name + " legs", legs, posts));
}

void addPerson(World& w, const std::string& name, const Walk& walk, float lift_arm) {
  Thing thing{name,
              Role::kIntruder,
              [=](double t) { return person(walk, t, lift_arm); },
              walk.start,
              walk.start + walk.length() + 0.0,
              false};
  w.things.push_back(thing);
}

/// Positions of static and moving things over time, so that nothing passes through anything else.
struct Spots {
  using Way =
      std::function<std::optional<Eigen::Vector2f>(double)>;  ///< nothing while it is absent
  struct Mover {
    Way way;
    float radius;
  };
  std::vector<Eigen::Vector3f> taken;  ///< x, y, radius
  std::vector<Mover> movers;
  bool isFree(const Eigen::Vector2f& p, float r) const {
    return std::none_of(taken.begin(), taken.end(), [&](const auto& it) {
      return (it.template head<2>() - p).norm() < it.z() + r;
    });
  }
  bool take(float x, float y, float r) {
    if (!isFree({x, y}, r)) return false;
    taken.push_back({x, y, r});
    return true;
  }
  bool move(const Way& way, float r, double seconds) {
    for (double t = 0; t < seconds; t += .1) {
      const auto p = way(t);
      if (!p) continue;
      if (!isFree(*p, r)) return false;
      for (const Mover& other : movers)
        if (const auto q = other.way(t); q && (*q - *p).norm() < r + other.radius) return false;
    }
    movers.push_back({way, r});
    return true;
  }
};

/// Unmodeled things, chosen by the seed. \param top  height of a table around the robot,
/// or 0
void addIntruders(World& w, Rng& rng, Spots& spots, double seconds, bool has_walls) {
  const auto place = [&](float r, float lo, float hi) -> std::optional<Eigen::Vector2f> {
    for (int i = 0; i < 200; ++i) {
      const float a = uniform(rng, -kPi, kPi), d = uniform(rng, lo, hi);
      const Eigen::Vector2f p(d * std::cos(a), d * std::sin(a));
      if (std::abs(p.x()) < 1.8F - r && std::abs(p.y()) < 1.8F - r && spots.take(p.x(), p.y(), r))
        return p;
    }
    return std::nullopt;
  };
  const auto when = [&](Thing& thing) {  // half are there from the start, the others come later
    if (uniform(rng, 0, 1) < .5F) thing.from = uniform(rng, 1, static_cast<float>(seconds) * .6F);
    w.things.push_back(thing);
  };
  for (int i = 0; i < 3; ++i) {
    const V size(uniform(rng, .08F, .6F), uniform(rng, .08F, .6F), uniform(rng, .08F, .6F));
    const float r = size.head<2>().norm() / 2 + .15F;
    if (const auto p = place(r, .6F + r, 1.8F)) {
      Thing thing = fixed("box" + std::to_string(i), Role::kIntruder,
                          {box(at({p->x(), p->y(), size.z() / 2}, uniform(rng, 0, kPi)), size)});
      thing.size = size;
      when(thing);
    }
  }
  const int which = static_cast<int>(uniform(rng, 0, 3));
  if (which == 0) {
    if (const auto p = place(.5F, 1, 1.7F)) {  // a step ladder: four rails, rungs
      const Pose pose = at({p->x(), p->y(), 0}, uniform(rng, 0, kPi));
      std::vector<Shape> parts;
      for (const float y : {-.2F, .2F})
        for (const float x : {-.4F, .4F})
          parts.push_back(capsule(pose * V(x, y, .03F), pose * V(x * .1F, y, 1.5F), .025F));
      for (int k = 1; k < 6; ++k) {
        const float z = .25F * static_cast<float>(k), x = .4F * (1 - .9F * z / 1.5F);
        parts.push_back(box(pose * at({x, 0, z}), {.08F, .4F, .03F}));
      }
      Thing thing = fixed("ladder", Role::kIntruder, parts);
      when(thing);
    }
  } else if (which == 1) {
    if (const auto p = place(.45F, 1, 1.7F)) {  // a cable drum that lies on its side
      const Pose pose = at({p->x(), p->y(), 0}, uniform(rng, 0, kPi));
      Thing thing = fixed("drum", Role::kIntruder,
                          {cylinder(pose * at({0, 0, .02F}), .3F, .04F),
                           cylinder(pose * at({0, 0, .22F}), .12F, .4F),
                           cylinder(pose * at({0, 0, .42F}), .3F, .04F)});
      when(thing);
    }
  } else {  // a trolley that moves in by itself
    const float side = uniform(rng, 0, 1) < .5F ? -1.F : 1.F, v = uniform(rng, .4F, .9F);
    for (const float y : {1.4F * side, -1.4F * side}) {
      const auto x = [v](double t) { return 2.2F - v * static_cast<float>(t - 1); };
      const double end = 1 + 3.6 / v;
      if (!spots.move(
              [=](double t) {
                return t > 1 && t < end ? std::optional(Eigen::Vector2f(x(t), y)) : std::nullopt;
              },
              .4F, seconds))
        continue;
      Thing thing{"trolley",
                  Role::kIntruder,
                  [=](double t) {
                    const Pose pose = at({x(t), y, 0});
                    std::vector<Shape> parts{box(pose * at({0, 0, .3F}), {.7F, .45F, .06F}),
                                             box(pose * at({0, 0, .75F}), {.7F, .45F, .04F})};
                    for (const float dx : {-.32F, .32F})
                      for (const float s : {-.2F, .2F})
                        parts.push_back(cylinder(pose * at({dx, s, .4F}), .02F, .8F));
                    return parts;
                  },
                  1,
                  end,
                  false};
      w.things.push_back(thing);
      break;
    }
  }
  for (int i = 0; i < 30; ++i) {  // a ball that rolls
    const float v = uniform(rng, .5F, 1.5F),
                y = uniform(rng, .6F, 1.6F) * (uniform(rng, 0, 1) < .5F ? -1.F : 1.F),
                r = uniform(rng, .08F, .15F);
    const double start = uniform(rng, 0, static_cast<float>(seconds) / 2), end = start + 3.6 / v;
    const auto x = [=](double t) { return 2 - v * static_cast<float>(t - start); };
    if (!spots.move(
            [=](double t) {
              return t > start && t < end ? std::optional(Eigen::Vector2f(x(t), y)) : std::nullopt;
            },
            r + .05F, seconds))
      continue;
    Thing thing{"ball",
                Role::kIntruder,
                [=](double t) {
                  return std::vector<Shape>{sphere({x(t), y, r}, r)};
                },
                start,
                end,
                false};
    w.things.push_back(thing);
    break;
  }
  {  // a box that is thrown through the scene
    const float v = uniform(rng, 1.5F, 3), edge = uniform(rng, .12F, .3F),
                y = uniform(rng, -1.2F, 1.2F);
    const double start =
        uniform(rng, static_cast<float>(seconds) * .5F, static_cast<float>(seconds) - 1);
    Thing thing{
        "thrown",
        Role::kIntruder,
        [=](double t) {
          const float s = static_cast<float>(t - start);
          return std::vector<Shape>{
              box(at({1.9F - v * s, y, 1.2F + 1.5F * s - 1.9F * s * s}, 3 * s), V::Constant(edge))};
        },
        start,
        start + (has_walls ? 2.8 : 3.6) / v,
        false};
    w.things.push_back(thing);
  }
  {  // a hand and forearm that come in from the edge of the region, and go again
    const double start = uniform(rng, 0, static_cast<float>(seconds) / 3);
    const float y = uniform(rng, -.5F, .5F), z = uniform(rng, .9F, 1.4F);
    Thing thing{
        "hand",
        Role::kIntruder,
        [=](double t) {
          const float s = std::min(
              1.0F, .8F * static_cast<float>(std::sin(kPi * std::min(1.0, (t - start) / 2.5))));
          const V tip(2.1F - s, y, z);
          return std::vector<Shape>{capsule(tip, tip + V(.1F, 0, 0), .045F),
                                    capsule(tip + V(.1F, 0, 0), tip + V(1.2F, 0, .1F), .042F)};
        },
        start,
        start + 2.5,
        false};
    w.things.push_back(thing);
  }
  for (int i = 0; i < 2; ++i)  // people walk in, stand, and leave
    for (int tries = 0; tries < 100; ++tries) {
      const float a = has_walls ? uniform(rng, -1.2F, 1.2F) : uniform(rng, -kPi, kPi),
                  d = uniform(rng, .8F, 1.4F),
                  b = has_walls ? uniform(rng, -.5F, .5F) : a + uniform(rng, -.8F, .8F);
      const Eigen::Vector2f out(2.6F * std::cos(b), 2.6F * std::sin(b)),
          in(d * std::cos(a), d * std::sin(a));
      const Walk walk{{out, in, out},
                      uniform(rng, 1.1F, 1.6F),
                      1,
                      uniform(rng, 1.6F, 1.9F),
                      i * seconds / 2 + uniform(rng, 0, 1)};
      const auto way = [walk](double t) {
        return t > walk.start && t < walk.start + walk.length() ? std::optional(walk.at(t).place)
                                                                : std::nullopt;
      };
      if (!spots.move(way, .35F, seconds)) continue;
      addPerson(w, "person" + std::to_string(i), walk, uniform(rng, 0, 1) < .5F ? 1.2F : 0.F);
      break;
    }
}

/// Walls as slabs behind the given planes.
void addWalls(World& w, int count, float distance) {
  const float s = 10;
  std::vector<std::pair<V, V>> walls{{{-distance - .05F, 0, 1.25F}, {.1F, s, 2.5F}},
                                     {{0, -distance - .05F, 1.25F}, {s, .1F, 2.5F}},
                                     {{0, distance + .05F, 1.25F}, {s, .1F, 2.5F}}};
  for (int i = 0; i < count; ++i)
    w.things.push_back(fixed("wall" + std::to_string(i), Role::kFixture,
                             {box(at(walls[i].first), walls[i].second)}));
}

/// Scenes: a open floor and table from above; b corner of a room at 45°; c low sensor; d
/// palletizer; e workbench, fence, shelf. Special: L covered lens, N covered with NaN, K knocked by
/// 10°, P person cut off at the height of a table elsewhere, W people in front of a wall.
World build(char scene, unsigned seed, double seconds) {
  Rng rng(1000 * seed + static_cast<unsigned>(scene));
  World w;
  Spots spots;
  spots.taken.push_back({0, 0, .35F});
  w.robot.pace = uniform(rng, .8F, 1.6F);
  for (float& it : w.robot.phase) it = uniform(rng, 0, 2 * kPi);
  const char kind = std::strchr("LNK", scene) ? 'b' : scene;
  w.things.push_back(fixed("floor", Role::kSurface, {box(at({0, 0, -.05F}), {16, 16, .1F})}));
  const auto pedestal = [&](float h) {
    w.things.push_back(fixed("pedestal", Role::kModel, {box(at({0, 0, h / 2}), {.3F, .3F, h})}));
    w.robot.base = at({0, 0, h}, uniform(rng, -kPi, kPi));
  };
  if (kind == 'a') {
    addTable(w, "table", {.9F, 0, .75F}, 0, {.8F, 1.4F, .03F}, Role::kSurface, Role::kFixture);
    spots.taken.push_back({.9F, 0, .85F});
    pedestal(.7F);
    w.sensor = lookAt({.2F, 0, 3.2F}, {.2F, .01F, 0});
  } else if (kind == 'b') {
    pedestal(.5F);
    addTable(w, "table", {0, 1, .75F}, 0, {1.2F, .7F, .03F}, Role::kModel, Role::kModel);
    spots.taken.push_back({0, 1, .75F});
    addWalls(w, 2 + static_cast<int>(seed % 2), 1.9F);
    const float r = 3.3F * std::sqrt(.5F);
    w.sensor = lookAt({r, uniform(rng, -.6F, .6F), r + .3F}, {0, 0, .3F});
  } else if (kind == 'c') {
    pedestal(.6F);
    w.sensor = lookAt({2.6F, uniform(rng, -.5F, .5F), .9F}, {0, 0, .7F});
  } else if (kind == 'd') {
    pedestal(.4F);
    w.things.push_back(
        fixed("conveyor", Role::kModel, {box(at({0, -.9F, .35F}), {3.6F, .5F, .7F})}));
    w.things.push_back(
        fixed("pallet", Role::kFixture, {box(at({0, .95F, .07F}), {1.2F, .8F, .14F})}));
    std::vector<Shape> stack;
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 2; ++k)
        stack.push_back(box(at({-.36F + .37F * static_cast<float>(i),
                                .78F + .37F * static_cast<float>(k), .14F + .15F}),
                            {.35F, .35F, .3F}));
    stack.push_back(box(at({-.36F, .78F, .59F}), {.35F, .35F, .3F}));
    w.things.push_back(fixed("goods", Role::kFixture, stack));
    for (int i = 0; i < 4; ++i) {  // goods on the belt, 0.3 m/s
      const float offset = 1.1F * static_cast<float>(i);
      Thing thing{"parcel" + std::to_string(i),
                  Role::kIntruder,
                  [=](double t) {
                    const float x = -2 + std::fmod(offset + .3F * static_cast<float>(t), 4.4F);
                    return std::vector<Shape>{box(at({x, -.9F, .7F + .125F}), {.3F, .3F, .25F})};
                  },
                  -1e9,
                  1e9,
                  false};
      w.things.push_back(thing);
    }
    spots.taken.push_back({0, .95F, .75F});
    for (const float x : {-1.5F, -1.F, -.5F, 0.F, .5F, 1.F, 1.5F})
      spots.taken.push_back({x, -.9F, .4F});
    w.sensor = lookAt({1.9F, 1.2F, 2.9F}, {0, 0, .3F});
  } else if (kind == 'e') {
    pedestal(.75F);
    w.things.push_back(fixed("machine", Role::kModel,
                             {box(at({-.9F, .3F, .6F}), {.7F, .9F, 1.2F}),
                              cylinder(at({-.9F, .3F, 1.35F}), .15F, .3F)}));
    addTable(w, "bench", {.1F, -.95F, .9F}, 0, {1.6F, .6F, .04F}, Role::kSurface, Role::kFixture);
    std::vector<Shape> posts;
    for (int i = 0; i < 7; ++i)
      posts.push_back(
          box(at({-1.8F + .6F * static_cast<float>(i), 1.75F, .7F}), {.05F, .05F, 1.4F}));
    w.things.push_back(fixed("fence", Role::kFixture, posts));
    std::vector<Shape> shelf;
    for (const float z : {.1F, .6F, 1.1F, 1.6F})
      shelf.push_back(box(at({-1.75F, -1.2F, z}), {.35F, 1, .03F}));
    for (const float y : {-1.7F, -.7F})
      shelf.push_back(box(at({-1.75F, y, .8F}), {.35F, .03F, 1.6F}));
    w.things.push_back(fixed("shelf", Role::kFixture, shelf));
    spots.taken.push_back({-.9F, .3F, .65F});
    spots.taken.push_back({-.5F, -.95F, .4F});
    spots.taken.push_back({.1F, -.95F, .4F});
    spots.taken.push_back({.7F, -.95F, .4F});
    spots.taken.push_back({-1.75F, -1.2F, .6F});
    w.sensor = lookAt({2.2F, .8F, 2.3F}, {-.1F, 0, .5F});
  } else if (kind == 'P') {
    pedestal(.5F);
    const float top = uniform(rng, .7F, 1.15F);
    addTable(w, "far table", {-1, 1.2F, top}, 0, {1.3F, .9F, .03F}, Role::kSurface, Role::kFixture);
    w.sensor = lookAt({2.3F, 0, 2.4F}, {0, 0, .6F});
    for (int i = 0; i < 2; ++i) {
      const float y = uniform(rng, -1.2F, -.7F);
      addPerson(w, "person" + std::to_string(i),
                {{{-2.6F, y - .5F}, {uniform(rng, -.2F, .6F), y}, {-2.6F, y - .5F}},
                 1.3F,
                 1.2F,
                 1.75F,
                 i * seconds / 2},
                i ? 1.2F : 0.F);
    }
  } else {  // W
    pedestal(.5F);
    addWalls(w, 1, 1.5F);
    w.sensor = lookAt({2.3F, 0, 2.2F}, {-.3F, 0, .7F});
    for (int i = 0; i < 2; ++i) {
      const float y = uniform(rng, .4F, 1.0F) * (i ? 1.F : -1.F);
      addPerson(w, "person" + std::to_string(i),
                {{{-1.15F, 3 * y}, {uniform(rng, -1.2F, -1.1F), y}, {-1.15F, 3 * y}},
                 1.3F,
                 2,
                 1.75F,
                 i * seconds / 3},
                0);
    }
  }
  if (std::strchr("abcdeK", scene)) addIntruders(w, rng, spots, seconds, kind == 'b');
  w.believed = w.sensor;
  if (scene == 'K')
    w.sensor = w.sensor * Pose(Eigen::AngleAxisf(10 * kPi / 180, V(1, 1, 0).normalized()));
  if (scene == 'L' || scene == 'N') {
    w.covered_from = seconds / 2;
    if (scene == 'N') w.covered_at = std::nanf("");
  }
  w.things.insert(w.things.begin(), {"robot", Role::kRobot, nullptr, -1e9, 1e9, false});
  return w;
}

// ---------------------------------------------------------------- sensors

enum class Sensor { kKinect, kRealsense, kTof };
struct Lens {
  int width, height;
  float f;
};
/// Half of the real angular resolution in each case: Kinect v1 640x480, f 525; D435 640x360, 87°;
/// Azure-like ToF 640x576 of 75° x 65°, cropped to 4:3.
Lens lensOf(Sensor s) {
  if (s == Sensor::kKinect) return {320, 240, 262.5F};
  if (s == Sensor::kRealsense) return {320, 180, 168.6F};
  return {320, 240, 208.5F};
}
float sigmaOf(Sensor s, float z) {
  return s == Sensor::kKinect      ? .0013F * z * z
         : s == Sensor::kRealsense ? .0038F * z * z
                                   : std::hypot(.005F, .0005F * z * z);
}
const char* nameOf(Sensor s) {
  return s == Sensor::kKinect ? "kinect" : s == Sensor::kRealsense ? "realsense" : "tof";
}

struct Image {
  std::vector<float> depth, truth;  ///< along z; 0: nothing
  std::vector<int> owner;           ///< thing, or -1
  std::vector<int> alone;           ///< of each thing: pixels if nothing were in front of it
};

/// Smooth noise of standard deviation 1: white noise on a grid of `step` pixels, interpolated.
std::vector<float> smooth(Rng& rng, const Lens& lens, int step) {
  const int columns = lens.width / step + 3, rows = lens.height / step + 3;
  std::vector<float> grid(columns * rows), out(lens.width * lens.height);
  for (float& it : grid) it = 1.5F * gauss(rng);  // bilinear interpolation takes a third on average
  for (int v = 0; v < lens.height; ++v)
    for (int u = 0; u < lens.width; ++u) {
      const float x = static_cast<float>(u) / step, y = static_cast<float>(v) / step;
      const int i = static_cast<int>(x), k = static_cast<int>(y);
      const float a = x - i, b = y - k;
      const float* g = &grid[k * columns + i];
      out[v * lens.width + u] =
          (1 - b) * ((1 - a) * g[0] + a * g[1]) + b * ((1 - a) * g[columns] + a * g[columns + 1]);
    }
  return out;
}

Image render(const World& w, double t, const Lens& lens) {
  Image image;
  const int n = lens.width * lens.height;
  image.truth.assign(n, kFar);
  image.owner.assign(n, -1);
  image.alone.assign(w.things.size(), 0);
  std::vector<int> seen(n, -1);
  const Pose camera = w.sensor.inverse();
  for (size_t i = 0; i < w.things.size(); ++i) {
    if (!w.things[i].isThere(t)) continue;
    for (Shape s : w.things[i].role == Role::kRobot ? w.robot.posed(t) : w.things[i].shapes(t)) {
      s.pose = camera * s.pose;
      const V c = s.pose.translation();
      const float r = s.reach();
      int u0 = 0, u1 = lens.width - 1, v0 = 0, v1 = lens.height - 1;
      if (c.z() < -r) continue;
      if (c.z() > r + .05F) {
        const float near = c.z() - r;
        const auto span = [&](float center, int size, int& low, int& high) {
          const float a = std::min((center - r) / near, (center - r) / c.z()),
                      b = std::max((center + r) / near, (center + r) / c.z());
          low = std::max(0, static_cast<int>(std::floor(lens.f * a + size / 2.F)) - 1);
          high = std::min(size - 1, static_cast<int>(std::ceil(lens.f * b + size / 2.F)) + 1);
        };
        span(c.x(), lens.width, u0, u1);
        span(c.y(), lens.height, v0, v1);
      }
      for (int v = v0; v <= v1; ++v)
        for (int u = u0; u <= u1; ++u) {
          const V d((u - lens.width / 2.F + .5F) / lens.f, (v - lens.height / 2.F + .5F) / lens.f,
                    1);
          const float z = hit(s, V::Zero(), d);
          if (z >= kFar) continue;
          const int p = v * lens.width + u;
          if (seen[p] != static_cast<int>(i)) seen[p] = static_cast<int>(i), ++image.alone[i];
          if (z < image.truth[p]) image.truth[p] = z, image.owner[p] = static_cast<int>(i);
        }
    }
  }
  for (float& z : image.truth)
    if (z > 12) z = 0;
  return image;
}

/// Turns true depths into a sensor's measurements.
void measure(Image& image, Sensor sensor, const Lens& lens, Rng& rng,
             const std::vector<float>& wavy) {
  const int W = lens.width, H = lens.height;
  const std::vector<float>& z = image.truth;
  std::vector<float> out = z;
  const std::vector<float> patch =
      sensor == Sensor::kRealsense ? smooth(rng, lens, 4) : std::vector<float>();
  const auto isEdge = [&](float a, float b) {
    return a > 0 && b > 0 && std::abs(a - b) > .03F * std::min(a, b) + .01F;
  };
  for (int v = 0; v < H; ++v)
    for (int u = 0; u < W; ++u) {
      const int p = v * W + u;
      float d = z[p];
      if (d <= 0) continue;
      float other = 0;  // a depth beyond an edge next to this pixel
      for (const int q :
           {u > 0 ? p - 1 : p, u + 1 < W ? p + 1 : p, v > 0 ? p - W : p, v + 1 < H ? p + W : p})
        if (isEdge(z[q], d)) other = z[q];
      if (sensor == Sensor::kKinect) {
        if (other > 0 && uniform(rng, 0, 1) < .35F) d = 0;
        for (int k = 1; k <= 12 && d > 0 && u - k >= 0;
             ++k) {  // the shadow of the projector, 7.5 cm beside
          const float front = z[p - k];
          if (front > 0 && front < d - .05F && k <= lens.f * .075F * (1 / front - 1 / d)) d = 0;
        }
        constexpr float kStep = .00285F;  // m at 1 m: a step of disparity
        if (d > 0) d = 1 / (kStep * std::round((1 / d + .0013F * gauss(rng)) / kStep));
      } else if (sensor == Sensor::kRealsense) {
        if (other > 0 && uniform(rng, 0, 1) < .5F)
          d = uniform(rng, 0, 1) < .5F ? 0 : d + (other - d) * uniform(rng, 0, 1);
        if (patch[p] > 2.3F) d = 0;
        const float s = sigmaOf(sensor, d);
        d += s * (.8F * patch[p] + .5F * wavy[p] + .33F * gauss(rng));
      } else {
        if (other > 0 && uniform(rng, 0, 1) < .4F) d += (other - d) * uniform(rng, 0, 1);
        const int k = std::max(2, static_cast<int>(.1F * lens.f / d));
        if (u >= k && u + k < W && v >= k &&
            v + k < H) {  // light that takes the path over the other wall
          float bend = 0;
          for (const auto& [a, b] : {std::pair(p - k, p + k), std::pair(p - k * W, p + k * W)})
            if (z[a] > 0 && z[b] > 0 && std::abs(z[a] - d) < .25F && std::abs(z[b] - d) < .25F)
              bend = std::max(bend, d - (z[a] + z[b]) / 2);
          d -= std::min(.02F, .35F * bend);
        }
        d += sigmaOf(sensor, d) * gauss(rng);
      }
      out[p] = std::isfinite(d) && d > .2F ? d : 0;
    }
  image.depth = out;
}

// ---------------------------------------------------------------- the evaluation

struct Tally {
  long clouds = 0, falses = 0, exchanged = 0, renumbered = 0, splits = 0, sights = 0, missed = 0,
       merged = 0, visits = 0, late = 0, distances = 0, too_far = 0, too_near = 0, hidden = 0,
       hidden_too_far = 0, edges = 0, edges_wrong = 0, blind = 0, contradictions = 0;
  float farthest = 0;
  double cpu = 0;
  std::map<std::string, long> falses_of, missed_of, merged_of, too_far_of, late_of;
  void add(const Tally& o) {
    for (auto m : {&Tally::clouds, &Tally::falses, &Tally::exchanged, &Tally::renumbered,
                   &Tally::splits, &Tally::sights, &Tally::missed, &Tally::merged, &Tally::visits,
                   &Tally::late, &Tally::distances, &Tally::too_far, &Tally::too_near,
                   &Tally::hidden, &Tally::hidden_too_far, &Tally::edges, &Tally::edges_wrong,
                   &Tally::blind, &Tally::contradictions})
      this->*m += o.*m;
    farthest = std::max(farthest, o.farthest);
    cpu += o.cpu;
    for (auto m : {&Tally::falses_of, &Tally::missed_of, &Tally::merged_of, &Tally::too_far_of,
                   &Tally::late_of})
      for (const auto& [name, count] : o.*m) (this->*m)[name] += count;
  }
};

bool dump = false;

struct Run {
  char scene;
  Sensor sensor;
  int hz;
  unsigned seed;
  bool learn;
  double seconds;
};

std::string sortOf(std::string name) {
  while (!name.empty() && std::isdigit(static_cast<unsigned char>(name.back()))) name.pop_back();
  return name;
}

std::vector<KnownBody> bodiesOf(const World& w) {
  const float reach = FinderSettings().padding + .01F;
  std::vector<KnownBody> bodies;
  int i = 0;
  for (const auto& link : Robot::shapes())
    bodies.emplace_back("link" + std::to_string(i++), meshOf(link), reach, true);
  for (const Thing& thing : w.things)
    if (thing.role == Role::kModel)
      bodies.emplace_back(thing.name, meshOf(thing.shapes(0)), reach, false);
  return bodies;
}

class Judge {
 public:
  Judge(const Run& run)
      : run_(run),
        w_(build(run.scene, run.seed, run.seconds)),
        lens_(lensOf(run.sensor)),
        rng_(77 * run.seed + run.scene),
        finder_(bodiesOf(w_), FinderSettings()) {
    wavy_ = smooth(rng_, lens_, 20);
    states_.resize(w_.things.size());
  }

  Tally judge() {
    if (run_.learn) learn();
    for (int i = 0; i < static_cast<int>(run_.seconds * run_.hz); ++i)
      cloud(static_cast<double>(i) / run_.hz, true);
    return tally_;
  }

 private:
  struct State {
    int seen = 0;        ///< consecutive clouds in which it had to be detected
    bool shown = false;  ///< in this visit
    std::uint32_t number = 0;
    std::vector<V> places;  ///< its points when it was last seen
  };

  void say(const char* what, double t, std::uint32_t number, const std::string& thing,
           const V& place, const std::string& more = "") const {
    if (dump)
      std::printf("DUMP %c %s %dHz seed%u learn%d t=%.2f %s object %u %s at %.2f %.2f %.2f %s\n",
                  run_.scene, nameOf(run_.sensor), run_.hz, run_.seed, run_.learn, t, what, number,
                  thing.c_str(), place.x(), place.y(), place.z(), more.c_str());
  }

  /// Boxes that `cell expect` makes of what is seen for 3 s before anyone comes.
  void learn() {
    const World full = w_;
    for (Thing& thing : w_.things)
      if (thing.role == Role::kIntruder) thing.to = -1e10;
    std::map<std::uint32_t, std::vector<TrackedObject>> sights;
    std::vector<TrackedObject> latest;
    for (int i = 0; i < 3 * run_.hz; ++i) {
      latest = cloud(-100 + static_cast<double>(i) / run_.hz, false);
      for (const auto& it : latest) sights[it.number].push_back(it);
    }
    for (const auto& seen : latest) {
      const UprightBox& b = seen.object.box;
      const float lo = std::min(b.size.x(), b.size.y()), hi = std::max(b.size.x(), b.size.y());
      bool ok = seen.is_confirmed && seen.is_seen && lo <= 1.5F &&
                !(b.size.z() >= 1.3F && b.size.z() <= 2.1F && hi <= 1);
      Eigen::AlignedBox3f extent;
      for (const auto& it : sights[seen.number]) {
        ok = ok && it.velocity.norm() <= .05F && (it.object.box.center - b.center).norm() <= .05F;
        if (!it.is_seen) continue;
        const UprightBox& o = it.object.box;
        const float c = std::abs(std::cos(o.yaw)), s = std::abs(std::sin(o.yaw));
        const V half =
            V(c * o.size.x() + s * o.size.y(), s * o.size.x() + c * o.size.y(), o.size.z()) / 2;
        extent.extend(V(o.center - half));
        extent.extend(V(o.center + half));
      }
      if (!ok) continue;
      const V size = extent.sizes() + V::Constant(.06F);
      expected_.emplace_back(extent.center().cast<double>(), size.cast<double>());
    }
    w_ = full;
    tracks_.reset();
    if (dump)
      std::printf("DUMP %c %s learned %zu boxes of %zu objects\n", run_.scene, nameOf(run_.sensor),
                  expected_.size(), latest.size());
  }

  Scene sceneAt(double t) const {
    Scene scene{w_.believed, {}, std::nullopt, {}};
    const Pose camera = w_.believed.inverse();
    for (const Pose& pose : w_.robot.poses(t)) scene.cloud_from_body.push_back(camera * pose);
    while (scene.cloud_from_body.size() < finder_.bodies().size())
      scene.cloud_from_body.push_back(camera);
    const Eigen::Isometry3d global(w_.believed.matrix().cast<double>());
    scene.region.emplace(global, w_.region);
    for (const auto& it : expected_) scene.expected.emplace_back(global, it);
    return scene;
  }

  std::vector<TrackedObject> cloud(double t, bool is_judged) {
    Image image = render(w_, t, lens_);
    measure(image, run_.sensor, lens_, rng_, wavy_);
    const int n = lens_.width * lens_.height;
    const bool covered = t >= w_.covered_from;
    Points points{std::vector<V>(n), static_cast<size_t>(lens_.width),
                  static_cast<size_t>(lens_.height)};
    for (int p = 0; p < n; ++p) {
      const float z = covered ? w_.covered_at + .001F * gauss(rng_) : image.depth[p];
      points.places[p] = z > 0 ? V(ray(p) * z) : V(V::Constant(std::nanf("")));
    }
    timespec a{}, b{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &a);
    const Scene scene = sceneAt(t);
    std::vector<TrackedObject> tracked;
    std::vector<FoundObject> found;
    const auto labels = finder_.label(points, scene);
    const bool any = std::any_of(points.places.begin(), points.places.end(),
                                 [](const V& it) { return it.allFinite(); });
    const bool blind = !any || !ObjectFinder::looksIntoRegion(points, labels, scene);
    if (!blind) {
      found = finder_.find(points, labels, scene, tracks_.predictedAt(t));
      tracked = tracks_.update(
          t, found,
          [&](const UprightBox& it) {
            return isHidden(it, points, labels, scene.global_from_cloud);
          },
          [&](const Cluster& places) { return finder_.distanceTo(places, scene); });
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &b);
    if (!is_judged) return tracked;
    tally_.cpu += static_cast<double>(b.tv_sec - a.tv_sec) +
                  1e-9 * static_cast<double>(b.tv_nsec - a.tv_nsec);
    ++tally_.clouds;
    if (blind) ++tally_.blind;
    if (any && t >= next_check_) {
      next_check_ = t + 1;
      const Agreement agreement = finder_.agreement(points, labels, scene);
      in_a_row_ = agreement.isContradiction() ? in_a_row_ + 1 : 0;
      if (in_a_row_ >= 3) ++tally_.contradictions;
    }
    if (!blind && !covered) compare(t, image, scene, tracked, placesOf(tracked, found));
    return tracked;
  }

  /// Returns the points of each tracked object in this cloud: tracks do not keep them. The found
  /// object has the same number of points, or, if parts were added, several together have.
  static std::vector<Cluster> placesOf(const std::vector<TrackedObject>& tracked,
                                       const std::vector<FoundObject>& found) {
    std::vector<Cluster> places(tracked.size());
    std::vector<size_t> left;
    for (size_t f = 0; f < found.size(); ++f) {
      std::optional<size_t> best;
      float least = kFar;
      for (size_t k = 0; k < tracked.size(); ++k) {
        if (!tracked[k].is_seen || !places[k].empty() ||
            tracked[k].object.points != found[f].points)
          continue;
        const float away = distanceTo(tracked[k].object.box, found[f].box.center);
        if (away < least) least = away, best = k;
      }
      if (best)
        places[*best] = found[f].places;
      else
        left.push_back(f);
    }
    std::stable_sort(left.begin(), left.end(),
                     [&](size_t a, size_t b) { return found[a].points > found[b].points; });
    for (const size_t f : left) {
      std::optional<size_t> best;
      float least = .5F;
      for (size_t k = 0; k < tracked.size(); ++k) {
        if (!tracked[k].is_seen || places[k].size() + found[f].points > tracked[k].object.points)
          continue;
        const float away = distanceTo(tracked[k].object.box, found[f].box.center);
        if (away < least) least = away, best = k;
      }
      if (best)
        places[*best].insert(places[*best].end(), found[f].places.begin(), found[f].places.end());
    }
    return places;
  }

  V ray(int p) const {
    return V((p % lens_.width - lens_.width / 2.F + .5F) / lens_.f,
             (p / lens_.width - lens_.height / 2.F + .5F) / lens_.f, 1);
  }

  void compare(double t, const Image& image, const Scene& scene,
               const std::vector<TrackedObject>& tracked, const std::vector<Cluster>& places_of) {
    const auto robot = w_.robot.posed(t);
    const auto toRobot = [&](const V& place) {
      float least = kFar;
      for (const Shape& s : robot) least = std::min(least, distance(s, place));
      return least;
    };
    const size_t count = w_.things.size();
    // The visible points of each thing: in the region, outside expected boxes.
    std::vector<std::vector<V>> visible(count);
    std::vector<float> nearest(count, kFar), sigma(count, 0);
    std::vector<V> nearest_place(count, V::Zero());
    const bool knocked = run_.scene == 'K';
    for (int p = 0; p < static_cast<int>(image.truth.size()); ++p) {
      const int o = image.owner[p];
      if (o < 0 || !w_.things[o].isUnmodeled() || image.truth[p] <= 0 || image.depth[p] <= 0)
        continue;
      const V local = ray(p) * image.truth[p];
      if (!(*scene.region)(local) ||
          !inner(V(w_.sensor * local), 4 * sigmaOf(run_.sensor, local.z())) ||
          std::any_of(scene.expected.begin(), scene.expected.end(),
                      [&](const auto& it) { return it(local); }))
        continue;
      visible[o].push_back(w_.sensor * local);
    }
    for (size_t i = 0; i < count; ++i)
      for (const V& it : visible[i]) {
        const float d = toRobot(it);
        if (d < nearest[i])
          nearest[i] = d, nearest_place[i] = it,
          sigma[i] = sigmaOf(run_.sensor, (w_.sensor.inverse() * it).z());
      }
    // The things to which the objects' points belong.
    const Pose camera = w_.believed.inverse();
    std::vector<std::map<int, int>> shares(tracked.size());
    std::vector<int> main(tracked.size(), -1);
    std::vector<std::vector<size_t>> objects_of(count), touching(count);
    for (size_t i = 0; i < tracked.size(); ++i) {
      const TrackedObject& it = tracked[i];
      if (!it.is_seen) continue;
      int unmodeled = 0, total = 0;
      for (const V& place : places_of[i]) {
        const V c = camera * place;
        const int u = static_cast<int>(std::floor(lens_.f * c.x() / c.z() + lens_.width / 2.F)),
                  v = static_cast<int>(std::floor(lens_.f * c.y() / c.z() + lens_.height / 2.F));
        if (u < 0 || v < 0 || u >= lens_.width || v >= lens_.height) continue;
        const int o = image.owner[v * lens_.width + u];
        ++total;
        ++shares[i][o];
        if (o >= 0 && w_.things[o].isUnmodeled()) ++unmodeled;
      }
      int best = -1, most = 0;
      for (const auto& [o, n] : shares[i]) {
        if (n > most) most = n, best = o;
        if (o >= 0 && n >= 15) touching[o].push_back(i);
      }
      if (total > 0 && unmodeled < .3 * total) {
        ++tally_.falses;
        const std::string of = best < 0 ? "nothing" : sortOf(w_.things[best].name);
        ++tally_.falses_of[of];
        say("FALSE", t, it.number, of, it.object.box.center,
            "points " + std::to_string(it.object.points) + " size " + text(it.object.box.size) +
                (it.is_confirmed ? "" : " unconfirmed") + dist(it));
        continue;
      }
      most = 0;
      for (const auto& [o, n] : shares[i])
        if (o >= 0 && w_.things[o].isUnmodeled() && n > most) most = n, main[i] = o;
      if (main[i] < 0) continue;
      objects_of[main[i]].push_back(i);
      // A number that belonged to another thing before.
      const auto [known, is_new] = thing_of_.try_emplace(it.number, main[i]);
      if (!is_new && known->second != main[i]) {
        const bool counts = w_.things[known->second].role == Role::kIntruder ||
                            w_.things[main[i]].role == Role::kIntruder;
        if (counts) ++tally_.exchanged;
        if (counts)
          say("EXCHANGED", t, it.number,
              w_.things[known->second].name + "->" + w_.things[main[i]].name, it.object.box.center);
        known->second = main[i];
      }
    }
    for (size_t o = 0; o < count; ++o) {
      const Thing& thing = w_.things[o];
      State& state = states_[o];
      if (thing.role != Role::kIntruder) continue;
      const auto& own = objects_of[o];
      if (own.size() > 1) {
        ++tally_.splits;
        std::string parts;
        for (const size_t i : own) {
          const UprightBox& part = tracked[i].object.box;
          parts += ", " + std::to_string(tracked[i].number) + " " + text(part.size) + " at " +
                   text(part.center);
        }
        say("SPLIT", t, tracked[own[1]].number, thing.name, tracked[own[1]].object.box.center,
            "into " + std::to_string(own.size()) + parts);
      }
      if (!own.empty()) {
        const auto largest = *std::max_element(own.begin(), own.end(), [&](size_t a, size_t b) {
          return tracked[a].object.points < tracked[b].object.points;
        });
        if (state.number && state.number != tracked[largest].number && own.size() == 1 &&
            state.seen > 0) {
          ++tally_.renumbered;
          say("RENUMBERED", t, tracked[largest].number, thing.name,
              tracked[largest].object.box.center, "was " + std::to_string(state.number));
        }
        state.number = tracked[largest].number;
        if (shares[largest][static_cast<int>(o)] >
            .9 * static_cast<double>(places_of[largest].size()))
          judgeSize(t, thing, image.alone[o], visible[o], tracked[largest]);
      }
      const bool sought =
          visible[o].size() >= 80 && nearest[o] >= .08F && isLarge(visible[o]) && !knocked;
      V middle = V::Zero();
      for (const V& it : visible[o]) middle += it / static_cast<float>(visible[o].size());
      if (sought) {
        ++tally_.sights;
        ++state.seen;
        const bool shown = !own.empty();
        if (!shown) {
          const bool merged = !touching[o].empty();
          ++(merged ? tally_.merged : tally_.missed);
          std::string with;
          if (merged) {
            const int partner = main[touching[o].front()];
            with =
                "+" + (partner < 0 ? std::string("false object") : sortOf(w_.things[partner].name));
          }
          ++(merged ? tally_.merged_of : tally_.missed_of)[sortOf(thing.name) + with];
          say(merged ? "MERGED" : "MISSED", t, merged ? tracked[touching[o].front()].number : 0,
              thing.name + with, middle,
              "pixels " + std::to_string(visible[o].size()) + " since " +
                  std::to_string(state.seen) + fateOf(image, scene, o));
        }
        if (shown || !touching[o].empty()) state.shown = true;
        if (state.seen == 1) ++tally_.visits;
        if (state.seen == 2 && !state.shown) {
          ++tally_.late;
          ++tally_.late_of[sortOf(thing.name)];
          say("LATE", t, 0, thing.name, middle, "pixels " + std::to_string(visible[o].size()));
        }
      } else if (visible[o].size() < 20) {
        state.seen = 0;
        state.shown = false;
      }
      if (knocked) continue;
      // The least distance shown for it: its own, or that of the object taken to contain it.
      float least = kFar;
      std::uint32_t number = 0;
      V where = V::Zero();
      for (size_t i = 0; i < tracked.size(); ++i) {
        const bool own_seen =
            std::find(touching[o].begin(), touching[o].end(), i) != touching[o].end() ||
            main[i] == static_cast<int>(o);
        const auto known = thing_of_.find(tracked[i].number);
        const bool own_hidden =
            !tracked[i].is_seen && known != thing_of_.end() && known->second == static_cast<int>(o);
        if ((own_seen || own_hidden) && tracked[i].object.robot &&
            tracked[i].object.robot->distance < least)
          least = tracked[i].object.robot->distance, number = tracked[i].number,
          where = tracked[i].object.robot->on_object;
      }
      const float padding = FinderSettings().padding;
      if (least < kFar && visible[o].size() >= 80 && nearest[o] > .05F) {
        ++tally_.distances;
        judgeDistance(t, thing, least, std::max(nearest[o], padding), sigma[o], number, where,
                      false, dump ? causeAt(image, scene, nearest_place[o], places_of) : "");
      } else if (least < kFar && visible[o].size() < 20 && thing.still &&
                 state.places.size() > 80) {
        float truth = kFar, s = 0;
        for (const V& it : state.places)
          if (const float d = toRobot(it); d < truth)
            truth = d, s = sigmaOf(run_.sensor, (w_.sensor.inverse() * it).z());
        ++tally_.hidden;
        judgeDistance(t, thing, least, std::max(truth, padding), s, number, where, true, "");
      }
      if (visible[o].size() >= 80) state.places = visible[o];
    }
  }

  void judgeDistance(double t, const Thing& thing, float shown, float truth, float sigma,
                     std::uint32_t number, const V& where, bool hidden, const std::string& cause) {
    const float by = shown - truth;
    if (!hidden && by < -.02F - 3 * sigma) ++tally_.too_near;
    if (by <= .02F + 3 * sigma) return;
    ++(hidden ? tally_.hidden_too_far : tally_.too_far);
    ++tally_.too_far_of[sortOf(thing.name) + (hidden ? "(hidden)" : "")];
    tally_.farthest = std::max(tally_.farthest, by);
    char more[96];
    std::snprintf(more, sizeof(more), "shown %.3f true %.3f by %.3f sigma %.3f", shown, truth, by,
                  sigma);
    say(hidden ? "TOOFAR-HIDDEN" : "TOOFAR", t, number, thing.name, where, more + cause);
  }

  void judgeSize(double t, const Thing& thing, int alone, const std::vector<V>& visible,
                 const TrackedObject& object) {
    if (thing.size.isZero() || !object.is_confirmed || visible.size() < 100 ||
        visible.size() < .97 * alone * (run_.sensor == Sensor::kKinect ? .9 : 1))
      return;
    const V camera = w_.sensor.translation();
    const float range = (visible.front() - camera).norm();
    if (camera.z() < thing.size.z() + .1F) return;
    const auto sorted = [](V it) {
      if (it.x() > it.y()) std::swap(it.x(), it.y());
      return it;
    };
    const V is = sorted(object.object.box.size), truth = sorted(thing.size);
    for (int i = 0; i < 3; ++i) {
      ++tally_.edges;
      if (std::abs(is[i] - truth[i]) <= .01F + .01F * range) continue;
      ++tally_.edges_wrong;
      say("SIZE", t, object.number, thing.name, object.object.box.center,
          "edge " + std::to_string(i) + " is " + text(is) + " true " + text(truth));
    }
  }

  /// Returns the position of the nearest point, the labels around it, and whether it is part of an
  /// object.
  std::string causeAt(const Image& image, const Scene& scene, const V& place,
                      const std::vector<Cluster>& places_of) {
    const V c = w_.sensor.inverse() * place;
    const int u = static_cast<int>(std::floor(lens_.f * c.x() / c.z() + lens_.width / 2.F)),
              v = static_cast<int>(std::floor(lens_.f * c.y() / c.z() + lens_.height / 2.F));
    const auto labels = labelsOf(image, scene);
    std::string around;
    for (int b = std::max(0, v - 1); b <= std::min(lens_.height - 1, v + 1); ++b)
      for (int a = std::max(0, u - 1); a <= std::min(lens_.width - 1, u + 1); ++a)
        around += "no-kesft"[static_cast<int>(labels[b * lens_.width + a])];
    float away = kFar;
    for (const Cluster& it : places_of)
      for (const V& p : it) away = std::min(away, (p - place).norm());
    char more[128];
    std::snprintf(more, sizeof(more),
                  " | truly at %.2f %.2f %.2f labels %s, %.2f from a published point, u%d v%d",
                  place.x(), place.y(), place.z(), around.c_str(), away, u, v);
    return more;
  }

  std::vector<Label> labelsOf(const Image& image, const Scene& scene) {
    Points points{std::vector<V>(image.depth.size()), static_cast<size_t>(lens_.width),
                  static_cast<size_t>(lens_.height)};
    for (size_t p = 0; p < image.depth.size(); ++p)
      points.places[p] = image.depth[p] > 0 ? V(ray(static_cast<int>(p)) * image.depth[p])
                                            : V(V::Constant(std::nanf("")));
    return finder_.label(points, scene);
  }

  /// Returns the labels of the pixels of a thing, to find causes.
  std::string fateOf(const Image& image, const Scene& scene, size_t thing) {
    if (!dump) return "";
    const auto labels = labelsOf(image, scene);
    std::map<int, int> fates;
    for (size_t p = 0; p < labels.size(); ++p)
      if (image.owner[p] == static_cast<int>(thing)) ++fates[static_cast<int>(labels[p])];
    static const char* names[] = {"nowhere",  "outside", "known", "robot",
                                  "expected", "stray",   "free",  "thin"};
    std::string out = " labels";
    for (const auto& [label, n] : fates)
      out += std::string(" ") + names[label] + ":" + std::to_string(n);
    return out + " noise " + std::to_string(finder_.noise().at_one_m);
  }

  /// Returns true if a point is in the region, and not so near to its edge that noise may have
  /// moved it there.
  bool inner(const V& place, float inset) const {
    const V from = (place - w_.region.center().cast<float>()).cwiseAbs();
    const V half = w_.region.halfExtents().cast<float>();
    return from.x() < half.x() - inset && from.y() < half.y() - inset;
  }

  static bool isLarge(const std::vector<V>& places) {
    V mean = V::Zero();
    for (const V& it : places) mean += it / static_cast<float>(places.size());
    Eigen::Matrix3f spread = Eigen::Matrix3f::Zero();
    for (const V& it : places) spread += (it - mean) * (it - mean).transpose();
    const Eigen::Matrix3f axes =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f>(spread).eigenvectors();
    for (const int axis : {1, 2}) {
      float low = kFar, high = -kFar;
      for (const V& it : places)
        low = std::min(low, axes.col(axis).dot(it)), high = std::max(high, axes.col(axis).dot(it));
      if (high - low < .05F) return false;
    }
    return true;
  }

  static std::string text(const V& v) {
    char out[64];
    std::snprintf(out, sizeof(out), "%.2fx%.2fx%.2f", v.x(), v.y(), v.z());
    return out;
  }
  static std::string dist(const TrackedObject& it) {
    return it.object.robot ? " robot " + std::to_string(it.object.robot->distance) : "";
  }

  Run run_;
  World w_;
  Lens lens_;
  Rng rng_;
  ObjectFinder finder_;
  ObjectTracks tracks_;
  std::vector<pv::cloud::Box> expected_;
  std::vector<float> wavy_;
  std::vector<State> states_;
  std::map<std::uint32_t, int> thing_of_;
  Tally tally_;
  double next_check_ = 0;
  int in_a_row_ = 0;
};

void print(const std::string& name, const Tally& t) {
  std::printf(
      "%-24s %6ld %6.1f %5ld %5ld %5ld %6ld %5ld %5ld %4ld/%-4ld %5ld/%-5ld %4.0f %5ld %3ld/%-4ld "
      "%4ld/%-4ld %5.1f %4ld %3ld\n",
      name.c_str(), t.clouds, t.clouds ? 1000.0 * t.falses / t.clouds : 0, t.exchanged,
      t.renumbered, t.splits, t.sights, t.missed, t.merged, t.late, t.visits, t.too_far,
      t.distances, 100 * t.farthest, t.too_near, t.hidden_too_far, t.hidden, t.edges_wrong, t.edges,
      t.clouds ? 1000 * t.cpu / t.clouds : 0, t.blind, t.contradictions);
  std::fflush(stdout);
}

void printCauses(const char* what, const std::map<std::string, long>& counts) {
  std::vector<std::pair<long, std::string>> sorted;
  for (const auto& [name, n] : counts) sorted.emplace_back(n, name);
  std::sort(sorted.rbegin(), sorted.rend());
  std::printf("%-10s", what);
  for (const auto& [n, name] : sorted) std::printf(" %s:%ld", name.c_str(), n);
  std::printf("\n");
}

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> parts;
  std::stringstream stream(list);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
  return parts;
}

int main(int argc, char** argv) {
  std::map<std::string, std::string> options{
      {"--scene", "a,b,c,d,e"}, {"--sensor", "kinect,realsense,tof"},
      {"--hz", "10"},           {"--seed", "1"},
      {"--learn", "0"},         {"--seconds", "8"}};
  for (int i = 1; i < argc; ++i) {
    if (!std::strcmp(argv[i], "--dump"))
      dump = true;
    else if (options.count(argv[i]) && i + 1 < argc) {
      options[argv[i]] = argv[i + 1];
      ++i;
    } else {
      std::fprintf(stderr, "unknown option %s\n", argv[i]);
      return 2;
    }
  }
  std::printf("%-24s %6s %6s %5s %5s %5s %6s %5s %5s %9s %11s %4s %5s %8s %9s %5s %4s %3s\n",
              "scene", "clouds", "f/1000", "exch", "renum", "split", "sights", "miss", "merge",
              "late/vis", "toofar/dist", "cm", "near", "hid", "size", "ms", "blnd", "con");
  Tally all;
  std::map<std::string, Tally> by_sensor;
  for (const auto& scene : split(options["--scene"]))
    for (const auto& sensor : split(options["--sensor"]))
      for (const auto& learn : split(options["--learn"]))
        for (const auto& hz : split(options["--hz"])) {
          Tally sum;
          for (const auto& seed : split(options["--seed"])) {
            const Sensor s = sensor == "kinect"      ? Sensor::kKinect
                             : sensor == "realsense" ? Sensor::kRealsense
                                                     : Sensor::kTof;
            sum.add(Judge({scene[0], s, std::stoi(hz), static_cast<unsigned>(std::stoul(seed)),
                           learn == "1", std::stod(options["--seconds"])})
                        .judge());
          }
          print(scene + " " + sensor + " " + hz + "Hz" + (learn == "1" ? " learned" : ""), sum);
          all.add(sum);
          by_sensor[sensor].add(sum);
        }
  for (const auto& [name, tally] : by_sensor) print("all " + name, tally);
  print("all", all);
  printCauses("false:", all.falses_of);
  printCauses("missed:", all.missed_of);
  printCauses("merged:", all.merged_of);
  printCauses("late:", all.late_of);
  printCauses("too far:", all.too_far_of);
}
