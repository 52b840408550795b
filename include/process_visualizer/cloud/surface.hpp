// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace process_visualizer::cloud {

using SurfaceCloud = pcl::PointCloud<pcl::PointNormal>;

/// A surface of triangles, their corners anticlockwise as seen from outside.
using Surface = std::vector<std::array<Eigen::Vector3f, 3>>;

/// Where a point is, m.
template <typename Point>
Eigen::Vector3f placeOf(const Point& point) {
  return {point.x, point.y, point.z};
}

/// Where its surface looks to.
inline Eigen::Vector3f normalOf(const pcl::PointNormal& point) {
  return {point.normal_x, point.normal_y, point.normal_z};
}

/// The surface of a box about the origin. \param size  full lengths of its edges
Surface boxSurface(const Eigen::Vector3f& size);

/// An upright cylinder about the origin. \param size  diameters along x and y, and its height
Surface cylinderSurface(const Eigen::Vector3f& size);

/// An ellipsoid about the origin. \param size  diameters along x, y and z
Surface sphereSurface(const Eigen::Vector3f& size);

/// The surface in the contents of a file, whose upper axis and unit are those of RViz.
/// \param content    of the file
/// \param extension  of its name, which says what it is: dae, stl, obj
/// \throws std::invalid_argument that says why it has none
Surface readSurface(const std::vector<char>& content, const std::string& extension);

/// Adds points of a surface with their normals, one for each square of the spacing on average.
/// \param spacing_m   how far from each other
/// \param pose        from the surface's coordinates to those of the points
/// \param cloud       gets the points
void addPoints(const Surface& surface, const Eigen::Affine3d& pose, double spacing_m,
               SurfaceCloud& cloud);

/// The points of surfaces that can be seen from a place: those that face it, and have no others
/// before them.
SurfaceCloud visibleFrom(const Eigen::Vector3f& place, const SurfaceCloud& points,
                         double spacing_m);

}  // namespace process_visualizer::cloud
