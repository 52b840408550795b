// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include <Eigen/Geometry>
#include <vector>

#include "process_visualizer/cloud/neighbours.hpp"
#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::cloud {

/// Moves a cloud that nearly lies on a model onto it: least squares of the distances of single
/// points from the planes of the model's points next to them.
///
/// Means of neighbours have little noise, but they lie inside of what bulges or has an edge, so
/// that ICP with them leaves a cloud some tenths of a millimetre beside the model. Here the mean
/// distance of neighbours only decides whether they lie on it. What is near an edge is left out.
///
/// \param groups  of the cloud's points, in the model's frame but for `start`
/// \param model   points with normals, which are seen
/// \param tree    of the model
/// \param spacing_m  of the model's points
/// \param start   what moves the cloud nearly onto the model
/// \return what moves it onto the model; `start` if too little of it lies on parts without edges,
///         or if these do not hold it in all directions
Eigen::Isometry3d refined(const std::vector<Neighbours>& groups, const SurfaceCloud& model,
                          const pcl::search::KdTree<pcl::PointNormal>& tree, double spacing_m,
                          const Eigen::Isometry3d& start);

}  // namespace process_visualizer::cloud
