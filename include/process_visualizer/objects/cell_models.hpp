// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "process_visualizer/objects/known_bodies.hpp"

namespace process_visualizer::objects {

/// The links of a device's model, from the parameter `/NAME/robot_description`.
/// \param reach  of their distance fields, m
/// \throws std::invalid_argument that names the parameter and says what is wrong
std::vector<KnownBody> bodiesOf(const std::string& device, float reach, bool is_robot);

}  // namespace process_visualizer::objects
