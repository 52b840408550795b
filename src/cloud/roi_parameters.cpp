// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/roi_parameters.hpp"

#include <stdexcept>

#include "process_visualizer/common/frame_name.hpp"

namespace process_visualizer::cloud {
namespace {

using XmlRpc::XmlRpcValue;

/// A parameter's value; invalid if it is not set. A deleted one remains as an empty struct.
XmlRpcValue read(const ros::NodeHandle& node_handle, const std::string& name) {
  XmlRpcValue value;
  if (!node_handle.getParamCached(name, value)) return {};
  const bool deleted = value.getType() == XmlRpcValue::TypeStruct && value.size() == 0;
  return deleted ? XmlRpcValue() : value;
}

[[noreturn]] void reject(const ros::NodeHandle& node_handle, const std::string& name,
                         const std::string& must_be) {
  throw std::invalid_argument("parameter " + node_handle.resolveName(name) + " must be " + must_be);
}

bool isNumber(const XmlRpcValue& value) {
  return value.getType() == XmlRpcValue::TypeDouble || value.getType() == XmlRpcValue::TypeInt;
}

double toDouble(const XmlRpcValue& value) {
  return value.getType() == XmlRpcValue::TypeInt ? static_cast<int>(value)
                                                 : static_cast<double>(value);
}

Eigen::Vector3d readVector(const ros::NodeHandle& node_handle, const std::string& name,
                           XmlRpcValue value) {
  bool is_vector = value.getType() == XmlRpcValue::TypeArray && value.size() == 3;
  for (int i = 0; is_vector && i < 3; ++i) is_vector = isNumber(value[i]);
  if (!is_vector) reject(node_handle, name, "a list of three numbers [x, y, z] in metres");
  return {toDouble(value[0]), toDouble(value[1]), toDouble(value[2])};
}

Eigen::Vector3d readCenter(const ros::NodeHandle& node_handle) {
  const XmlRpcValue value = read(node_handle, "center");
  if (!value.valid()) return Eigen::Vector3d::Zero();
  return readVector(node_handle, "center", value);
}

std::string readFrame(const ros::NodeHandle& node_handle) {
  const XmlRpcValue value = read(node_handle, "frame");
  if (!value.valid()) return {};
  if (value.getType() != XmlRpcValue::TypeString) reject(node_handle, "frame", "a frame's name");
  return withoutLeadingSlash(value);
}

}  // namespace

RoiParameters readRoiParameters(const ros::NodeHandle& node_handle) {
  const Eigen::Vector3d center = readCenter(node_handle);
  const Eigen::Vector3d size = readVector(node_handle, "size", read(node_handle, "size"));
  const std::string frame = readFrame(node_handle);
  try {
    return {Box(center, size), frame};
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("parameter " + node_handle.getNamespace() + "/" + error.what());
  }
}

}  // namespace process_visualizer::cloud
