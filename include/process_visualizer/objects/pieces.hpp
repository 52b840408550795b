// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "process_visualizer/objects/clusters.hpp"
#include "process_visualizer/objects/occlusions.hpp"
#include "process_visualizer/objects/upright_box.hpp"

namespace process_visualizer::objects {

/// Where an object that is followed is thought to be.
struct ExpectedObject {
  UprightBox box;
  bool is_whole;           ///< whether it has been seen without anything that hid a part of it
  bool is_moving = false;  ///< fast: what moves may change its shape, as a person does
};

/// Which expected object, if any, more than half of a group's points belong to, as they lie in its
/// box or near to it.
std::optional<std::size_t> ownerOf(const Cluster& points,
                                   const std::vector<ExpectedObject>& expected);

/// Divides groups in which several expected objects touch: each point belongs to the nearest one.
/// \param places  of all points
/// \param fewest  points of an object
std::vector<Indices> divided(const std::vector<Indices>& groups, const Cluster& places,
                             const std::vector<ExpectedObject>& expected, std::size_t fewest);

/// Which groups are parts of one thing that something hides in between: those that belong to one
/// expected object, and those that may go on as one surface, and belong to none that is known to
/// be smaller. \return for each group the first one of its thing
std::vector<std::uint32_t> wholes(const std::vector<std::optional<std::size_t>>& owners,
                                  const std::vector<ExpectedObject>& expected,
                                  const std::vector<Bridge>& bridges);

}  // namespace process_visualizer::objects
