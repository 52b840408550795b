// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "process_visualizer/cloud/surface.hpp"
#include "process_visualizer/objects/point_image.hpp"

namespace process_visualizer::objects {

/// A shape whose intersection with rays has a formula, m.
struct Solid {
  enum class Kind { kBox, kEllipsoid, kCapsule };

  Kind kind;
  Eigen::Vector3f size;  ///< full lengths; a capsule lies along z, its diameter is size.x()
  Eigen::Isometry3f pose = Eigen::Isometry3f::Identity();
};

namespace solids {

constexpr float kMiss = std::numeric_limits<float>::infinity();

/// Returns where a ray enters a box about the origin, as a multiple of its direction.
inline float meetsBox(const Eigen::Vector3f& from, const Eigen::Vector3f& way,
                      const Eigen::Vector3f& half) {
  const Eigen::Array3f a = (-half - from).array() / way.array(),
                       b = (half - from).array() / way.array();
  const float begin = a.min(b).maxCoeff(), end = a.max(b).minCoeff();
  return begin > 0 && begin < end ? begin : kMiss;
}

inline float meetsSphere(const Eigen::Vector3f& from, const Eigen::Vector3f& way, float radius) {
  const float a = way.squaredNorm(), b = from.dot(way), c = from.squaredNorm() - radius * radius;
  const float root = b * b - a * c;
  if (root < 0) return kMiss;
  const float first = (-b - std::sqrt(root)) / a;
  return first > 0 ? first : kMiss;
}

inline float meetsCapsule(const Eigen::Vector3f& from, const Eigen::Vector3f& way, float radius,
                          float length) {
  const float half = std::max(0.0F, length / 2 - radius);
  const Eigen::Vector2f start = from.head<2>(), along = way.head<2>();
  const float a = along.squaredNorm(), b = start.dot(along),
              c = start.squaredNorm() - radius * radius, root = b * b - a * c;
  float best = kMiss;
  if (a > 0 && root >= 0) {
    const float first = (-b - std::sqrt(root)) / a;
    if (first > 0 && std::abs(from.z() + first * way.z()) <= half) best = first;
  }
  for (const float end : {-half, half})
    best = std::min(best, meetsSphere(from - Eigen::Vector3f(0, 0, end), way, radius));
  return best;
}

inline float meets(const Solid& solid, const Eigen::Vector3f& from, const Eigen::Vector3f& way) {
  switch (solid.kind) {
    case Solid::Kind::kBox:
      return meetsBox(from, way, solid.size / 2);
    case Solid::Kind::kEllipsoid: {
      const Eigen::Array3f scale = 2 / solid.size.array();
      return meetsSphere((from.array() * scale).matrix(), (way.array() * scale).matrix(), 1);
    }
    case Solid::Kind::kCapsule:
      return meetsCapsule(from, way, solid.size.x() / 2, solid.size.z());
  }
  return kMiss;
}

/// Returns the half lengths of the smallest enclosing box whose edges are parallel to the axes.
inline Eigen::Vector3f halfExtents(const Solid& solid) {
  const Eigen::Matrix3f turn = solid.pose.linear();
  const Eigen::Vector3f half = solid.size / 2;
  switch (solid.kind) {
    case Solid::Kind::kBox:
      return turn.cwiseAbs() * half;
    case Solid::Kind::kEllipsoid:
      return (turn * half.asDiagonal()).rowwise().norm();
    case Solid::Kind::kCapsule:
      return turn.col(2).cwiseAbs() * (half.z() - half.x()) + Eigen::Vector3f::Constant(half.x());
  }
  return half;
}

}  // namespace solids

/// Kind of a depth sensor, which determines its errors.
enum class SensorKind { kKinect, kRealSense, kTimeOfFlight };

struct SensorModel {
  SensorKind kind;
  std::string name;
  int width, height;
  float focal;     ///< px
  float baseline;  ///< m, between the sender and the receiver of light
};

inline SensorModel kinect() { return {SensorKind::kKinect, "kinect", 640, 480, 525, 0.075F}; }
inline SensorModel realsense() {
  return {SensorKind::kRealSense, "realsense", 640, 480, 385, 0.05F};
}
inline SensorModel timeOfFlight() {
  return {SensorKind::kTimeOfFlight, "tof", 512, 424, 366, 0.02F};
}

/// Returns the standard deviation of depths by distance, m, on a surface that faces the sensor.
inline float noiseOf(const SensorModel& sensor, float depth) {
  switch (sensor.kind) {
    case SensorKind::kKinect:
      return 0.0013F * depth * depth;
    case SensorKind::kRealSense:
      return 0.08F * depth * depth / (sensor.focal * sensor.baseline);
    default:
      return 0.0025F + 0.001F * depth * depth;
  }
}

/// Normally distributed numbers, correlated between neighbors: of a lattice, interpolated between.
class CorrelatedNoise {
 public:
  CorrelatedNoise(int width, int height, int spacing)
      : columns_(width / spacing + 2),
        spacing_(spacing),
        values_(static_cast<std::size_t>(columns_) * (height / spacing + 2)) {}

  void draw(std::mt19937& random) {
    std::normal_distribution<float> normal(0, 1.5F);  // interpolation reduces it by a third
    for (float& value : values_) value = normal(random);
  }

  float at(int row, int column) const {
    const int y = row / spacing_, x = column / spacing_;
    const float v = static_cast<float>(row % spacing_) / static_cast<float>(spacing_),
                u = static_cast<float>(column % spacing_) / static_cast<float>(spacing_);
    const float* here = &values_[static_cast<std::size_t>(y) * columns_ + x];
    const float upper = here[0] + u * (here[1] - here[0]),
                lower = here[columns_] + u * (here[columns_ + 1] - here[columns_]);
    return upper + v * (lower - upper);
  }

 private:
  int columns_, spacing_;
  std::vector<float> values_;
};

/// A sensor of one of these kinds; its errors are partly the same from cloud to cloud.
class SensedWorld {
 public:
  static constexpr int kNothing = -1;

  SensedWorld(SensorModel model, unsigned seed)
      : model_(std::move(model)),
        random_(seed),
        lasting_(model_.width, model_.height, kPatch),
        fresh_(model_.width, model_.height, kPatch),
        holes_(model_.width, model_.height, 2 * kPatch) {
    lasting_.draw(random_);
  }

  const SensorModel& model() const { return model_; }

  /// Begins a picture. \param pose  of the sensor in the world, z forward
  void begin(const Eigen::Isometry3f& pose) {
    pose_ = pose;
    depths_.assign(static_cast<std::size_t>(model_.width) * model_.height, solids::kMiss);
    things_.assign(depths_.size(), kNothing);
  }

  void draw(const Solid& solid, int thing) {
    const Eigen::Isometry3f to_solid = solid.pose.inverse() * pose_;
    std::vector<Eigen::Vector3f> corners;
    for (int corner = 0; corner < 8; ++corner)
      corners.push_back(to_solid.inverse() *
                        Eigen::Vector3f(solid.size.x() * ((corner & 1) != 0 ? 0.5F : -0.5F),
                                        solid.size.y() * ((corner & 2) != 0 ? 0.5F : -0.5F),
                                        solid.size.z() * ((corner & 4) != 0 ? 0.5F : -0.5F)));
    const Eigen::Vector3f from = to_solid.translation();
    const Eigen::Matrix3f turn = to_solid.linear();
    drawWithin(corners, thing,
               [&](const Eigen::Vector3f& way) { return solids::meets(solid, from, turn * way); });
  }

  void draw(const cloud::Surface& mesh, const Eigen::Isometry3f& pose, int thing) {
    const Eigen::Isometry3f transform = pose_.inverse() * pose;
    for (const cloud::Triangle& it : mesh) {
      const Eigen::Vector3f a = transform * it[0], b = transform * it[1], c = transform * it[2];
      const Eigen::Vector3f normal = (b - a).cross(c - a);
      const Eigen::Vector3f ab = a.cross(b), bc = b.cross(c), ca = c.cross(a);
      drawWithin({a, b, c}, thing, [&](const Eigen::Vector3f& way) {
        const float u = way.dot(ab), v = way.dot(bc), w = way.dot(ca);
        const bool is_inside = (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
        return is_inside ? normal.dot(a) / normal.dot(way) : solids::kMiss;
      });
    }
  }

  const Eigen::Isometry3f& pose() const { return pose_; }

  /// The thing and the position in the world that each pixel shows, without the sensor's errors.
  const std::vector<int>& things() const { return things_; }
  Eigen::Vector3f place(std::size_t pixel) const { return pose_ * (ray(pixel) * depths_[pixel]); }

  /// Returns the cloud in the sensor's frame; NaN where it measures nothing.
  Points points() {
    fresh_.draw(random_);
    holes_.draw(random_);
    const std::vector<float> mixed = withMixedPixels();
    const std::vector<bool> is_dark = shadows();
    Points points;
    points.width = model_.width;
    points.height = model_.height;
    points.places.reserve(mixed.size());
    for (std::size_t pixel = 0; pixel < mixed.size(); ++pixel) {
      const bool is_seen = std::isfinite(mixed[pixel]) && !is_dark[pixel] && !isHole(pixel);
      points.places.emplace_back(is_seen ? Eigen::Vector3f(ray(pixel) * measured(pixel, mixed))
                                         : Eigen::Vector3f::Constant(NAN));
    }
    return points;
  }

 private:
  static constexpr int kPatch = 6;  ///< px

  Eigen::Vector3f ray(std::size_t pixel) const {
    const auto row = static_cast<float>(pixel / model_.width),
               column = static_cast<float>(pixel % model_.width);
    return {(column - static_cast<float>(model_.width - 1) / 2) / model_.focal,
            (row - static_cast<float>(model_.height - 1) / 2) / model_.focal, 1};
  }

  template <typename Meets>
  void drawWithin(const std::vector<Eigen::Vector3f>& corners, int thing, const Meets& meets) {
    Eigen::AlignedBox<float, 2> box;
    bool is_all = false;  // a part of it is beside or behind the sensor
    for (const Eigen::Vector3f& corner : corners) {
      if (corner.z() < 0.05F) is_all = true;
      box.extend(Eigen::Vector2f(corner.head<2>() * (model_.focal / corner.z())));
    }
    if (is_all && corners.size() == 3) return;
    const Eigen::Vector2f middle(static_cast<float>(model_.width - 1) / 2,
                                 static_cast<float>(model_.height - 1) / 2);
    const auto bound = [&](float value, int most) {
      return static_cast<int>(std::clamp(value, 0.0F, static_cast<float>(most - 1)));
    };
    const int top = is_all ? 0 : bound(box.min().y() + middle.y(), model_.height),
              bottom =
                  is_all ? model_.height - 1 : bound(box.max().y() + middle.y() + 1, model_.height),
              left = is_all ? 0 : bound(box.min().x() + middle.x(), model_.width),
              right =
                  is_all ? model_.width - 1 : bound(box.max().x() + middle.x() + 1, model_.width);
    for (int row = top; row <= bottom; ++row) {
      for (int column = left; column <= right; ++column) {
        const std::size_t pixel = static_cast<std::size_t>(row) * model_.width + column;
        const float depth = meets(ray(pixel));
        if (!(depth > 0.05F) || depth >= depths_[pixel]) continue;
        depths_[pixel] = depth;
        things_[pixel] = thing;
      }
    }
  }

  /// Mixes both sides of an edge in its pixels: seldom for structured light, always for time of
  /// flight; a stereo sensor assigns some of the background to the foreground.
  std::vector<float> withMixedPixels() {
    std::vector<float> depths = depths_;
    std::uniform_real_distribution<float> part(0, 1);
    const float often = model_.kind == SensorKind::kTimeOfFlight ? 0.9F : 0.4F;
    const int reach = model_.kind == SensorKind::kRealSense ? 3 : 1;
    const auto mix = [&](std::size_t pixel, std::size_t beside) {
      const float here = depths_[pixel], there = depths_[beside];
      if (!std::isfinite(here) || !std::isfinite(there) || !(here - there > 0.04F)) return;
      if (part(random_) > often) return;
      const bool is_fat = model_.kind == SensorKind::kRealSense && part(random_) < 0.8F;
      depths[pixel] = is_fat ? there : there + (here - there) * part(random_);
    };
    for (int row = 0; row < model_.height; ++row) {
      for (int column = 0; column < model_.width; ++column) {
        const std::size_t pixel = static_cast<std::size_t>(row) * model_.width + column;
        for (int step = 1; step <= reach; ++step) {
          if (column >= step) mix(pixel, pixel - step);
          if (column + step < model_.width) mix(pixel, pixel + step);
          if (row >= step) mix(pixel, pixel - static_cast<std::size_t>(step) * model_.width);
        }
      }
    }
    return depths;
  }

  /// Returns the pixels where the foreground occludes the light, or one of two eyes.
  std::vector<bool> shadows() const {
    std::vector<bool> is_dark(depths_.size());
    for (int row = 0; row < model_.height; ++row) {
      float least = solids::kMiss;
      for (int column = model_.width - 1; column >= 0; --column) {
        const std::size_t pixel = static_cast<std::size_t>(row) * model_.width + column;
        const float there =
            static_cast<float>(column) - model_.focal * model_.baseline / depths_[pixel];
        is_dark[pixel] = there > least + 1;
        least = std::min(least, there);
      }
    }
    return is_dark;
  }

  bool isHole(std::size_t pixel) const {
    const int row = static_cast<int>(pixel) / model_.width,
              column = static_cast<int>(pixel) % model_.width;
    const float limit = model_.kind == SensorKind::kRealSense ? 2.2F : 2.8F;
    return holes_.at(row, column) > limit;
  }

  float measured(std::size_t pixel, const std::vector<float>& depths) {
    const int row = static_cast<int>(pixel) / model_.width,
              column = static_cast<int>(pixel) % model_.width;
    const float depth = depths[pixel];
    std::normal_distribution<float> alone(0, 1);
    if (model_.kind == SensorKind::kTimeOfFlight) {
      const float wiggle = 0.004F * std::sin(21 * depth);
      const float shared = 0.4F * fresh_.at(row, column) + 0.3F * lasting_.at(row, column);
      return depth + wiggle + noiseOf(model_, depth) * (0.85F * alone(random_) + shared);
    }
    const float pixels = model_.focal * model_.baseline;
    if (model_.kind == SensorKind::kRealSense) {
      const float shared = 0.65F * fresh_.at(row, column) + 0.65F * lasting_.at(row, column);
      const float disparity = pixels / depth + 0.08F * (shared + 0.4F * alone(random_));
      return pixels / (std::round(32 * disparity) / 32);
    }
    const float shared = 0.2F * fresh_.at(row, column) + 0.15F * lasting_.at(row, column);
    return pixels / (std::round(8 * (pixels / depth) + shared + 0.25F * alone(random_)) / 8);
  }

  SensorModel model_;
  std::mt19937 random_;
  CorrelatedNoise lasting_, fresh_, holes_;
  Eigen::Isometry3f pose_ = Eigen::Isometry3f::Identity();
  std::vector<float> depths_;
  std::vector<int> things_;
};

/// A person of fifteen parts who walks along x, m. \param phase  of the steps, rad
inline std::vector<Solid> personAt(const Eigen::Isometry3f& feet, float phase) {
  std::vector<Solid> parts;
  const auto add = [&](Solid::Kind kind, const Eigen::Vector3f& size,
                       const Eigen::Isometry3f& pose) {
    parts.push_back({kind, size, feet * pose});
  };
  const auto at = [](float x, float y, float z) {
    return Eigen::Isometry3f(Eigen::Translation3f(x, y, z));
  };
  const auto turned = [](float angle) {
    return Eigen::Isometry3f(Eigen::AngleAxisf(angle, Eigen::Vector3f::UnitY()));
  };
  add(Solid::Kind::kEllipsoid, {0.20F, 0.17F, 0.25F}, at(0.02F, 0, 1.63F));  // head
  add(Solid::Kind::kEllipsoid, {0.26F, 0.42F, 0.52F}, at(0, 0, 1.25F));      // chest
  add(Solid::Kind::kEllipsoid, {0.25F, 0.36F, 0.36F}, at(0, 0, 0.95F));      // hips
  for (const float side : {-1.0F, 1.0F}) {
    const float swing = 0.45F * side * std::sin(phase);
    const float knee = 0.35F + 0.35F * std::max(0.0F, std::sin(phase + side));
    const Eigen::Isometry3f hip = at(0, 0.1F * side, 0.9F) * turned(swing);
    const Eigen::Isometry3f leg = hip * at(0, 0, -0.42F) * turned(knee - 0.3F);
    add(Solid::Kind::kCapsule, {0.16F, 0.16F, 0.52F}, hip * at(0, 0, -0.2F));
    add(Solid::Kind::kCapsule, {0.11F, 0.11F, 0.48F}, leg * at(0, 0, -0.2F));
    add(Solid::Kind::kEllipsoid, {0.26F, 0.09F, 0.08F}, leg * at(0.07F, 0, -0.42F));
    const Eigen::Isometry3f shoulder = at(0, 0.24F * side, 1.42F) * turned(-0.9F * swing);
    const Eigen::Isometry3f elbow = shoulder * at(0, 0, -0.3F) * turned(-0.5F);
    add(Solid::Kind::kCapsule, {0.09F, 0.09F, 0.36F}, shoulder * at(0, 0, -0.14F));
    add(Solid::Kind::kCapsule, {0.075F, 0.075F, 0.32F}, elbow * at(0, 0, -0.13F));
    add(Solid::Kind::kEllipsoid, {0.05F, 0.09F, 0.18F}, elbow * at(0, 0, -0.34F));
  }
  return parts;
}

}  // namespace process_visualizer::objects
