// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "process_visualizer/objects/stray_points.hpp"
#include "process_visualizer/objects/upright_box.hpp"

namespace process_visualizer::objects {

/// Whether most of what a sensor sees in the direction of a box is in front of it, so that nobody
/// knows whether something is there. A robot in it hides what is there, too.
/// \param box  in the global frame
bool isHidden(const UprightBox& box, const Points& points, const std::vector<Label>& labels,
              const Eigen::Isometry3f& global_from_cloud);

}  // namespace process_visualizer::objects
