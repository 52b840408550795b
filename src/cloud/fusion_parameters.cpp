// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/fusion_parameters.hpp"

#include <cmath>
#include <set>

#include "process_visualizer/cloud/require.hpp"
#include "process_visualizer/common/frame_name.hpp"

namespace process_visualizer::cloud {
namespace {

template <typename Value>
Value read(const ros::NodeHandle& node_handle, const std::string& name, Value value,
           const std::string& must_be) {
  require(!node_handle.hasParam(name) || node_handle.getParam(name, value),
          "parameter " + node_handle.resolveName(name) + " must be " + must_be);
  return value;
}

double readPositive(const ros::NodeHandle& node_handle, const std::string& name, double value) {
  const std::string must_be = "a number greater than zero";
  const double given = read(node_handle, name, value, must_be);
  require(std::isfinite(given) && given > 0,
          "parameter " + node_handle.resolveName(name) + " must be " + must_be);
  return given;
}

}  // namespace

FusionParameters readFusionParameters(const ros::NodeHandle& node_handle) {
  FusionParameters parameters;
  parameters.topics =
      read(node_handle, "topics", parameters.topics, "a list of topics with clouds");
  parameters.frame =
      withoutLeadingSlash(read<std::string>(node_handle, "frame", {}, "a frame's name"));
  parameters.voxel = readPositive(node_handle, "voxel", 0.005);
  parameters.timeout = readPositive(node_handle, "timeout", 1);
  const std::set<std::string> different(parameters.topics.begin(), parameters.topics.end());
  require(!different.empty() && different.size() == parameters.topics.size(),
          "parameter " + node_handle.resolveName("topics") + " must be a list of different topics");
  require(!parameters.frame.empty(),
          "parameter " + node_handle.resolveName("frame") + " must be a frame's name");
  return parameters;
}

}  // namespace process_visualizer::cloud
