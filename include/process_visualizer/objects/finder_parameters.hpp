// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/node_handle.h>

#include <optional>
#include <string>
#include <vector>

#include "process_visualizer/cloud/box.hpp"
#include "process_visualizer/objects/object_finder.hpp"
#include "process_visualizer/objects/object_messages.hpp"

namespace process_visualizer::objects {

/// A box and the frame it is given in.
struct FramedBox {
  std::string frame;
  cloud::Box box;
};

/// The private parameters of the nodelet ObjectFinder.
struct FinderParameters {
  std::string frame;                ///< the global frame, z up
  std::vector<std::string> robots;  ///< devices with `/NAME/robot_description`
  std::vector<std::string> others;  ///< likewise, that are no robots
  std::optional<FramedBox> region;  ///< where it is looked; everywhere without it
  std::vector<FramedBox> expected;
  Limits limits;
  FinderSettings settings;
};

/// \param node_handle  the private one of the nodelet
/// \throws std::invalid_argument that names the parameter and what it must be
FinderParameters readFinderParameters(const ros::NodeHandle& node_handle);

}  // namespace process_visualizer::objects
