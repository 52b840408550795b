// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Optimal assignment of rows to columns at the lowest total cost, such as detections to tracks.

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

namespace process_visualizer::objects {

/// Cost of a pair that is not allowed.
constexpr float kForbidden = 1e3F;

/// Pairs rows with columns: first as many as possible, then at the lowest total cost (Kuhn 1955,
/// Munkres 1957), in O(n² m) for n rows and m columns or the reverse.
/// \param costs  from 0 to 1, or kForbidden
/// \return the column of each row, if it has one
std::vector<std::optional<std::size_t>> bestPairs(const Eigen::MatrixXf& costs);

}  // namespace process_visualizer::objects
