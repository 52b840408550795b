// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Triangle surfaces of models: basic shapes, meshes, nearest points, and points sampled on them.

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace process_visualizer::cloud {

using SurfaceCloud = pcl::PointCloud<pcl::PointNormal>;

/// The corners, m, counterclockwise as seen from outside.
using Triangle = std::array<Eigen::Vector3f, 3>;

/// A surface of triangles in any order; models' surfaces are rarely closed.
using Surface = std::vector<Triangle>;

/// Returns the position of a point, m.
template <typename Point>
Eigen::Vector3f placeOf(const Point& point) {
  return {point.x, point.y, point.z};
}

/// Returns the outward normal of the surface at a point.
inline Eigen::Vector3f normalOf(const pcl::PointNormal& point) {
  return {point.normal_x, point.normal_y, point.normal_z};
}

/// The surface of a box about the origin. \param size  full lengths of its edges
Surface boxSurface(const Eigen::Vector3f& size);

/// An upright cylinder about the origin. \param size  diameters along x and y, and its height
Surface cylinderSurface(const Eigen::Vector3f& size);

/// An ellipsoid about the origin. \param size  diameters along x, y and z
Surface sphereSurface(const Eigen::Vector3f& size);

/// The surface in a mesh file, in m, with the transforms of its nodes applied. As in RViz, the unit
/// of a Collada file counts, and its up axis does not: z stays z.
/// \param name  of the file; its extension is the format: dae, stl, obj
/// \throws std::invalid_argument that names the file and says what is wrong with it
Surface readSurface(const std::vector<std::uint8_t>& content, const std::string& name);

/// Transforms a surface and adds it to another one.
void append(Surface& surface, const Surface& added, const Eigen::Affine3f& transform);

/// The point of a triangle that is nearest to `point` (Ericson, Real-Time Collision Detection,
/// 5.1.5).
Eigen::Vector3f closestPoint(const Triangle& triangle, const Eigen::Vector3f& point);

/// The smallest box around a surface whose edges are parallel to the axes.
Eigen::AlignedBox3f boundsOf(const Surface& surface);

/// Points on a surface; every position on it is within the spacing of one of them.
std::vector<Eigen::Vector3f> samplesOf(const Surface& surface, float spacing_m);

/// Adds points of a surface with their normals, one for each square of the spacing on average.
/// \param spacing_m   mean distance between neighboring points
/// \param pose        from the surface's coordinates to those of the points
/// \param cloud       gets the points
void addPoints(const Surface& surface, const Eigen::Affine3d& pose, double spacing_m,
               SurfaceCloud& cloud);
}  // namespace process_visualizer::cloud
