// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/triangle_mesh.hpp"

#include <algorithm>
#include <cmath>

namespace process_visualizer::objects {
namespace {

using Eigen::Vector3f;

constexpr int kSegments = 32;  // of a full circle: the radius is right to half a percent

/// The two triangles of a plane face with four corners.
void addFace(TriangleMesh& mesh, const Vector3f& a, const Vector3f& b, const Vector3f& c,
             const Vector3f& d) {
  mesh.push_back({a, b, c});
  mesh.push_back({a, c, d});
}

/// A point of a circle about the z axis.
Vector3f onCircle(float radius, int segment, float height) {
  const float angle = 2 * static_cast<float>(M_PI) * static_cast<float>(segment) / kSegments;
  return {radius * std::cos(angle), radius * std::sin(angle), height};
}

/// Surface of revolution between two circles about the z axis.
void addRing(TriangleMesh& mesh, float radius_0, float height_0, float radius_1, float height_1) {
  for (int segment = 0; segment < kSegments; ++segment)
    addFace(mesh, onCircle(radius_0, segment, height_0), onCircle(radius_0, segment + 1, height_0),
            onCircle(radius_1, segment + 1, height_1), onCircle(radius_1, segment, height_1));
}

}  // namespace

TriangleMesh boxMesh(const Vector3f& size) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    Vector3f across = Vector3f::Zero(), along = Vector3f::Zero(), out = Vector3f::Zero();
    across[(axis + 1) % 3] = size[(axis + 1) % 3] / 2;
    along[(axis + 2) % 3] = size[(axis + 2) % 3] / 2;
    out[axis] = size[axis] / 2;
    for (const Vector3f& center : {out, Vector3f(-out)})
      addFace(mesh, center - across - along, center + across - along, center + across + along,
              center - across + along);
  }
  return mesh;
}

TriangleMesh cylinderMesh(float radius, float length) {
  TriangleMesh mesh;
  addRing(mesh, radius, -length / 2, radius, length / 2);
  addRing(mesh, 0, -length / 2, radius, -length / 2);
  addRing(mesh, radius, length / 2, 0, length / 2);
  return mesh;
}

TriangleMesh sphereMesh(float radius) {
  TriangleMesh mesh;
  const auto angle = [](int ring) {
    return static_cast<float>(M_PI) * static_cast<float>(ring) / (kSegments / 2.0F);
  };
  for (int ring = 0; ring < kSegments / 2; ++ring)
    addRing(mesh, radius * std::sin(angle(ring)), -radius * std::cos(angle(ring)),
            radius * std::sin(angle(ring + 1)), -radius * std::cos(angle(ring + 1)));
  return mesh;
}

void append(TriangleMesh& mesh, const TriangleMesh& added, const Eigen::Affine3f& transform) {
  mesh.reserve(mesh.size() + added.size());
  for (const Triangle& it : added)
    mesh.push_back({transform * it.a, transform * it.b, transform * it.c});
}

Vector3f closestPoint(const Triangle& triangle, const Vector3f& point) {
  const auto& [a, b, c] = triangle;
  const Vector3f ab = b - a, ac = c - a, ap = point - a;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vector3f bp = point - b;
  const float d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const float on_ab = d1 * d4 - d3 * d2;
  if (on_ab <= 0 && d1 >= 0 && d3 <= 0) return d1 == d3 ? a : Vector3f(a + ab * (d1 / (d1 - d3)));
  const Vector3f cp = point - c;
  const float d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const float on_ac = d5 * d2 - d1 * d6;
  if (on_ac <= 0 && d2 >= 0 && d6 <= 0) return d2 == d6 ? a : Vector3f(a + ac * (d2 / (d2 - d6)));
  const float on_bc = d3 * d6 - d5 * d4, along = d4 - d3, back = d5 - d6;
  if (on_bc <= 0 && along >= 0 && back >= 0)
    return along + back == 0 ? b : Vector3f(b + (c - b) * (along / (along + back)));
  const float whole = on_bc + on_ac + on_ab;
  return a + ab * (on_ac / whole) + ac * (on_ab / whole);
}

Eigen::AlignedBox3f boundsOf(const TriangleMesh& mesh) {
  Eigen::AlignedBox3f bounds;
  for (const Triangle& it : mesh) bounds.extend(it.a).extend(it.b).extend(it.c);
  return bounds;
}

std::vector<Vector3f> samplesOf(const TriangleMesh& mesh, float spacing) {
  std::vector<Vector3f> samples;
  for (const Triangle& it : mesh) {
    const float longest =
        std::max({(it.b - it.a).norm(), (it.c - it.b).norm(), (it.a - it.c).norm()});
    const int steps = std::max(1, static_cast<int>(std::ceil(longest / spacing)));
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j)
        samples.emplace_back(it.a + (it.b - it.a) * (static_cast<float>(i) / steps) +
                             (it.c - it.a) * (static_cast<float>(j) / steps));
    }
  }
  return samples;
}

}  // namespace process_visualizer::objects
