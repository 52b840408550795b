// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace process_visualizer::objects {

/// Its corners, m.
struct Triangle {
  Eigen::Vector3f a, b, c;
};

/// A surface, as triangles in any order: models are seldom closed.
using TriangleMesh = std::vector<Triangle>;

/// A box around the origin with full edge lengths `size`, m.
TriangleMesh boxMesh(const Eigen::Vector3f& size);

/// A cylinder about the z axis, its middle at the origin, m.
TriangleMesh cylinderMesh(float radius, float length);

/// A sphere around the origin, m.
TriangleMesh sphereMesh(float radius);

/// Adds what `added` is after a transform to a mesh.
void append(TriangleMesh& mesh, const TriangleMesh& added, const Eigen::Affine3f& transform);

/// The point of a triangle that is nearest to `point` (Ericson, Real-Time Collision Detection,
/// 5.1.5).
Eigen::Vector3f closestPoint(const Triangle& triangle, const Eigen::Vector3f& point);

/// The smallest box around a mesh whose edges are parallel to the axes.
Eigen::AlignedBox3f boundsOf(const TriangleMesh& mesh);

/// Points on a surface so that none of it is farther than `spacing` (m) from one of them.
std::vector<Eigen::Vector3f> samplesOf(const TriangleMesh& mesh, float spacing);

}  // namespace process_visualizer::objects
