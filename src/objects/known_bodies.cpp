// SPDX-License-Identifier: BSD-3-Clause
// Surfaces of URDF links, the grid of posed bodies, and the search for the nearest robot.

#include "process_visualizer/objects/known_bodies.hpp"

#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <map>
#include <utility>

#include "process_visualizer/cloud/require.hpp"
#include "process_visualizer/common/frame_name.hpp"
#include "process_visualizer/common/xml_walk.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::AlignedBox3f;
using Eigen::Isometry3f;
using Eigen::Vector3f;
using Eigen::Vector3i;

Eigen::Affine3f toEigen(const urdf::Pose& pose) {
  double x, y, z, w;
  pose.rotation.getQuaternion(x, y, z, w);
  return Eigen::Affine3f(
      Eigen::Translation3f(
          Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z).cast<float>()) *
      Eigen::Quaterniond(w, x, y, z).normalized().cast<float>());
}

Eigen::Vector3f toEigen(const urdf::Vector3& vector) {
  return Eigen::Vector3d(vector.x, vector.y, vector.z).cast<float>();
}

cloud::Surface scaledMesh(const urdf::Mesh& mesh, const ReadResource& read) {
  cloud::Surface scaled;
  cloud::append(scaled, cloud::readSurface(read(mesh.filename), mesh.filename),
                Eigen::Affine3f(Eigen::Scaling(toEigen(mesh.scale))));
  return scaled;
}

cloud::Surface surfaceOf(const urdf::Geometry& geometry, const ReadResource& read) {
  switch (geometry.type) {
    case urdf::Geometry::BOX:
      return cloud::boxSurface(toEigen(dynamic_cast<const urdf::Box&>(geometry).dim));
    case urdf::Geometry::CYLINDER: {
      const auto& cylinder = dynamic_cast<const urdf::Cylinder&>(geometry);
      const Eigen::Vector3d size(2 * cylinder.radius, 2 * cylinder.radius, cylinder.length);
      return cloud::cylinderSurface(size.cast<float>());
    }
    case urdf::Geometry::SPHERE: {
      const double diameter = 2 * dynamic_cast<const urdf::Sphere&>(geometry).radius;
      return cloud::sphereSurface(Eigen::Vector3f::Constant(static_cast<float>(diameter)));
    }
    default:
      return scaledMesh(dynamic_cast<const urdf::Mesh&>(geometry), read);
  }
}

/// \param shapes  visuals or collisions
template <typename Shapes>
cloud::Surface surfaceOfAll(const Shapes& shapes, const ReadResource& read) {
  cloud::Surface surface;
  for (const auto& shape : shapes)
    if (shape && shape->geometry)
      cloud::append(surface, surfaceOf(*shape->geometry, read), toEigen(shape->origin));
  return surface;
}

}  // namespace

std::vector<LinkGeometry> linkGeometries(const std::string& urdf, const ReadResource& read) {
  walkXml(urdf.data(), urdf.size());  // refuses deep nesting, at which urdfdom would recurse
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(urdf);
  cloud::require(model != nullptr, "it is not a robot description (URDF)");
  std::vector<LinkGeometry> geometries;
  for (const auto& [name, link] : model->links_) {
    cloud::Surface mesh = surfaceOfAll(link->visual_array, read);
    if (mesh.empty()) mesh = surfaceOfAll(link->collision_array, read);
    if (!mesh.empty()) geometries.push_back({withoutLeadingSlash(name), std::move(mesh)});
  }
  return geometries;
}

// Bodies in their poses.

namespace {

constexpr float kMinCell = 0.08F;  // m
constexpr float kMaxCells = 64;    // along an axis
constexpr unsigned kWordBits = 64;

/// Axis-aligned box around a transformed box.
AlignedBox3f transformed(const AlignedBox3f& box, const Isometry3f& transform) {
  const Vector3f center = transform * box.center();
  const Vector3f half = transform.linear().cwiseAbs() * (box.sizes() / 2);
  return {center - half, center + half};
}

}  // namespace

PosedBodies::PosedBodies(const std::vector<KnownBody>& bodies,
                         const std::vector<Isometry3f>& cloud_from_body)
    : bodies_(bodies),
      cloud_from_body_(cloud_from_body),
      words_((bodies.size() + kWordBits - 1) / kWordBits) {
  for (const Isometry3f& transform : cloud_from_body)
    body_from_cloud_.push_back(transform.inverse());
  createGrid();
  for (std::size_t body = 0; body < bodies.size(); ++body) insert(body);
}

void PosedBodies::createGrid() {
  for (std::size_t body = 0; body < bodies_.size(); ++body)
    bounds_.extend(transformed(bodies_[body].field.bounds(), cloud_from_body_[body]));
  if (bounds_.isEmpty() || !bounds_.sizes().allFinite()) return;
  cell_ = std::max(kMinCell, bounds_.sizes().maxCoeff() / kMaxCells);
  count_ = (bounds_.sizes() / cell_).array().floor().cast<int>() + 1;
  masks_.assign(static_cast<std::size_t>(count_.prod()) * words_, 0);
}

/// Sets the body's bit in the cells that its box may touch, whose centers lie in the box grown by
/// half a cell's diagonal.
void PosedBodies::insert(std::size_t body) {
  AlignedBox3f box = bodies_[body].field.bounds();
  const AlignedBox3f around = transformed(box, cloud_from_body_[body]);
  const float margin = 0.87F * cell_;
  box.min().array() -= margin;
  box.max().array() += margin;
  const auto cellOf = [this](const Vector3f& place) -> Vector3i {
    const Vector3i cell = ((place - bounds_.min()) / cell_).array().floor().cast<int>();
    return cell.cwiseMax(0).cwiseMin(count_ - Vector3i::Ones());
  };
  const Vector3i first = cellOf(around.min()), last = cellOf(around.max());
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        const Vector3f center = bounds_.min() + cell_ * (Vector3f(x, y, z).array() + 0.5F).matrix();
        if (!box.contains(body_from_cloud_[body] * center)) continue;
        const std::size_t cell = (std::size_t(z) * count_.y() + y) * count_.x() + x;
        masks_[cell * words_ + body / kWordBits] |= Word{1} << (body % kWordBits);
      }
    }
  }
}

const KnownBody* PosedBodies::covering(const Vector3f& place, float padding) const {
  if (masks_.empty() || !bounds_.contains(place)) return nullptr;
  const Vector3i at = ((place - bounds_.min()) / cell_)
                          .cast<int>()
                          .cwiseMin(count_.array().matrix() - Vector3i::Ones());
  const std::size_t cell = (std::size_t(at.z()) * count_.y() + at.y()) * count_.x() + at.x();
  for (std::size_t word = 0; word < words_; ++word) {
    for (Word mask = masks_[cell * words_ + word]; mask != 0; mask &= mask - 1) {
      const std::size_t body = word * kWordBits + __builtin_ctzll(mask);
      if (bodies_[body].field.distance(body_from_cloud_[body] * place) <= padding)
        return &bodies_[body];
    }
  }
  return nullptr;
}

bool PosedBodies::isBehindRobot(const Vector3f& place, float depth) const {
  if (masks_.empty()) return false;
  const float range = place.norm();
  const Vector3f step = place * (depth / range);
  bool has_left = false;
  for (int number = 0; static_cast<float>(number) * depth < range - depth; ++number) {
    const KnownBody* body = covering(step * static_cast<float>(number), -depth);
    const bool is_inside = body && body->samples;
    if (is_inside && has_left) return true;
    has_left = has_left || !is_inside;
  }
  return false;
}

// Distances from robots.

namespace {

constexpr float kVoxel = 0.03F;  // m: edge of the voxels whose means are compared first

/// Lower bound of the distance between a point and a body, by the sphere around the body.
float minDistance(const KnownBody& body, const Isometry3f& from_body, const Vector3f& point) {
  return (from_body * body.samples->center() - point).norm() - body.samples->radius();
}

/// Updates the best distance if a body is nearer to one of the points.
void updateBest(RobotDistance& best, const Cluster& points, const KnownBody& body,
                const Isometry3f& from_body) {
  const Isometry3f to_body = from_body.inverse();
  for (const Vector3f& point : points) {
    if (minDistance(body, from_body, point) >= best.distance) continue;
    const NearestPlace nearest = body.samples->nearest(to_body * point);
    if (nearest.distance < best.distance)
      best = {body.frame, nearest.distance, point, from_body * nearest.place};
  }
}

/// The robots' links with lower bounds of their distances, nearest first.
std::vector<std::pair<float, std::size_t>> byMinDistance(const Vector3f& center,
                                                         const std::vector<KnownBody>& bodies,
                                                         const std::vector<Isometry3f>& from_body) {
  std::vector<std::pair<float, std::size_t>> order;
  for (std::size_t body = 0; body < bodies.size(); ++body)
    if (bodies[body].samples)
      order.emplace_back(minDistance(bodies[body], from_body[body], center), body);
  std::sort(order.begin(), order.end());
  return order;
}

/// The points near a place: some points of a voxel are nearer to a body than their mean.
Cluster around(const Cluster& points, const Vector3f& place) {
  Cluster near;
  for (const Vector3f& point : points)
    if ((point - place).squaredNorm() < 3 * kVoxel * kVoxel) near.push_back(point);
  return near;
}

}  // namespace

std::optional<RobotDistance> distanceToRobots(const Cluster& points,
                                              const std::vector<KnownBody>& bodies,
                                              const std::vector<Isometry3f>& from_body) {
  const Cluster means = thinned(points, kVoxel);
  RobotDistance best;
  best.distance = std::numeric_limits<float>::infinity();
  const auto order = byMinDistance(means.front(), bodies, from_body);
  for (const auto& [bound, body] : order) updateBest(best, means, bodies[body], from_body[body]);
  if (best.link.empty()) return std::nullopt;
  const auto nearest = std::find_if(bodies.begin(), bodies.end(),
                                    [&](const KnownBody& body) { return body.frame == best.link; });
  updateBest(best, around(points, best.on_object), *nearest, from_body[nearest - bodies.begin()]);
  return best;
}

}  // namespace process_visualizer::objects
