// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace process_visualizer::objects {

using Cluster = std::vector<Eigen::Vector3f>;
using Indices = std::vector<std::uint32_t>;

/// Divides points into those that hang together: each lies in a cube of a grid, and cubes that
/// touch belong together, at corners too. Points that are nearer than `cube` (its edge, m) are
/// never apart; those farther than 3.5 times as much are never together without others between
/// them. \return the points of each cluster of at least `fewest`, the order depends on the points
/// alone
std::vector<Indices> clustersOf(const std::vector<Eigen::Vector3f>& points, float cube,
                                std::size_t fewest);

/// The mean of the points in each cube of a grid, m.
std::vector<Eigen::Vector3f> thinned(const Cluster& points, float cube);

}  // namespace process_visualizer::objects
