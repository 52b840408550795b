// SPDX-License-Identifier: BSD-3-Clause
// Decodes the supported message types, and maps drivers' joint names to the robot's.

#include "process_visualizer/joints/joint_message.hpp"

#include <algorithm>
#include <boost/property_tree/xml_parser.hpp>
#include <cmath>
#include <cstddef>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "process_visualizer/common/message_bytes.hpp"
#include "process_visualizer/common/xml_walk.hpp"

namespace process_visualizer::joints {
namespace {

constexpr char kArray[] = "std_msgs/Float32MultiArray";
constexpr char kJointState[] = "sensor_msgs/JointState";
constexpr char kDynamicState[] = "control_msgs/DynamicJointState";
constexpr std::uint64_t kNsPerS = 1000000000;

/// std_msgs/Float32MultiArray: the elements from the layout's data_offset on.
std::vector<double> arrayValues(WireReader reader) {
  constexpr std::size_t kDimensionBytes = 12;
  for (std::size_t left = reader.count(kDimensionBytes); left > 0; --left) {
    reader.text();
    reader.number<std::uint32_t>();
    reader.number<std::uint32_t>();
  }
  const std::size_t padding = reader.number<std::uint32_t>();
  const std::vector<float> data = reader.numbers<float>();
  reader.end();
  if (padding > data.size())
    throw std::invalid_argument("its data_offset " + std::to_string(padding) + " is beyond its " +
                                std::to_string(data.size()) + " elements");
  return {data.begin() + static_cast<std::ptrdiff_t>(padding), data.end()};
}

/// std_msgs/Header: the stamp [ns].
std::uint64_t headerStamp(WireReader& reader) {
  reader.number<std::uint32_t>();  // sequence number
  const auto seconds = reader.number<std::uint32_t>();
  const auto nanoseconds = reader.number<std::uint32_t>();
  reader.text();  // frame
  return seconds * kNsPerS + nanoseconds;
}

/// sensor_msgs/JointState.
StampedJoints stateValues(WireReader reader) {
  StampedJoints found;
  found.stamp_ns = headerStamp(reader);
  found.joints.names = reader.texts();
  found.joints.positions = reader.numbers<double>();
  reader.numbers<double>();  // velocities
  reader.numbers<double>();  // efforts
  reader.end();
  return found;
}

/// control_msgs/DynamicJointState: the joints that have the interface "position".
StampedJoints dynamicValues(WireReader reader) {
  constexpr std::size_t kMinBytes = 8;  // two empty arrays
  StampedJoints found;
  found.stamp_ns = headerStamp(reader);
  const std::vector<std::string> names = reader.texts();
  const std::size_t count = reader.count(kMinBytes);
  if (count != names.size())
    throw std::invalid_argument(std::to_string(names.size()) + " joint names come with " +
                                std::to_string(count) + " interface_values");
  for (const std::string& name : names) {
    const std::vector<std::string> interfaces = reader.texts();
    const std::vector<double> values = reader.numbers<double>();
    const auto position = std::find(interfaces.begin(), interfaces.end(), "position");
    const auto row = static_cast<std::size_t>(position - interfaces.begin());
    if (row < std::min(interfaces.size(), values.size())) {
      found.joints.names.push_back(name);
      found.joints.positions.push_back(values[row]);
    }
  }
  reader.end();
  if (found.joints.names.empty())
    found.joints.names = names;  // then it counts as a state without positions
  return found;
}

}  // namespace

StampedJoints decodeJoints(const std::string& type, const std::vector<std::uint8_t>& bytes) {
  if (type != kArray && type != kJointState && type != kDynamicState)
    throw std::invalid_argument("it carries " + type + ", and " + kArray + ", " + kJointState +
                                " or " + kDynamicState + " is expected");
  try {
    if (type == kJointState) return stateValues(WireReader(bytes));
    if (type == kDynamicState) return dynamicValues(WireReader(bytes));
    return {{{}, arrayValues(WireReader(bytes))}, 0};
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("its bytes are not those of " + type + ": " + error.what());
  }
}

namespace {

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

[[noreturn]] void refuse(const std::string& problem) { throw std::invalid_argument(problem); }

}  // namespace

JointMatching::JointMatching(const std::string& robot_name, std::vector<std::string> joint_names,
                             const std::map<std::string, double>& offsets,
                             const std::string& prefix)
    : joint_names_(std::move(joint_names)) {
  const std::string robot = robot_name + "/";
  for (const std::string& name : joint_names_) joints_[name] = {name, 0.0};
  for (const std::string& name : joint_names_) {
    joints_.insert({prefix + name, {name, 0.0}});
    if (name.rfind(robot, 0) == 0) joints_.insert({name.substr(robot.size()), {name, 0.0}});
  }
  for (const auto& [name, offset] : offsets) {
    const auto found = joints_.find(name);
    if (found == joints_.end() || !std::isfinite(offset))
      refuse("an offset of " + name + ": the joints are " + listed(joint_names_));
    for (auto& [key, joint] : joints_)
      if (joint.name == found->second.name) joint.offset = offset;
  }
}

JointPositions JointMatching::match(const JointPositions& measured) const {
  return measured.names.empty() ? matchByOrder(measured.positions) : matchByName(measured);
}

JointPositions JointMatching::matchByOrder(const std::vector<double>& positions) const {
  const std::string expected = std::to_string(joint_names_.size());
  if (positions.size() != joint_names_.size())
    refuse(expected + " values are expected, one for each joint of " + listed(joint_names_) +
           ", not " + std::to_string(positions.size()));
  return matchByName({joint_names_, positions});
}

JointPositions JointMatching::matchByName(const JointPositions& measured) const {
  if (measured.positions.empty())
    throw ForeignJoints("it has no positions of " + listed(measured.names) +
                        ", only velocities or efforts");
  if (measured.names.size() != measured.positions.size())
    refuse(std::to_string(measured.names.size()) + " joint names come with " +
           std::to_string(measured.positions.size()) + " positions");
  JointPositions matched;
  for (std::size_t i = 0; i < measured.names.size(); ++i) {
    if (!(std::abs(measured.positions[i]) <= kMaxPosition)) {  // also NaN
      matched.unusable.push_back(measured.names[i]);
      continue;
    }
    const auto joint = joints_.find(measured.names[i]);
    if (joint == joints_.end()) continue;
    matched.names.push_back(joint->second.name);
    matched.positions.push_back(measured.positions[i] + joint->second.offset);
  }
  if (matched.names.empty() && matched.unusable.empty())
    throw ForeignJoints("none of the names " + listed(measured.names) +
                        " is a joint of the robot; its joints are " + listed(joint_names_));
  return matched;
}

std::string aboutUnusable(const std::vector<std::string>& joints) {
  if (joints.empty()) return "";
  if (joints.size() == 1)
    return "the position of " + joints.front() +
           " is NaN, infinite or beyond 1e6; that joint stays where it was";
  return "the positions of " + listed(joints) +
         " are NaN, infinite or beyond 1e6; those joints stay where they were";
}

std::vector<std::string> movableJoints(const std::string& urdf) {
  // as MOVABLE in robot/kinematics.py
  static const std::set<std::string> kMovable = {"revolute", "continuous", "prismatic"};
  std::vector<std::string> names;
  try {
    walkXml(urdf.data(), urdf.size());  // Boost recurses for each nested element
  } catch (const std::invalid_argument& error) {
    refuse(std::string("the URDF is not XML that can be read: ") + error.what());
  }
  try {
    std::istringstream stream(urdf);
    boost::property_tree::ptree document;
    boost::property_tree::read_xml(stream, document);
    for (const auto& [tag, element] : document.get_child("robot")) {
      if (tag == "joint" && !element.get_child_optional("mimic") &&
          kMovable.count(element.get("<xmlattr>.type", std::string())) != 0)
        names.push_back(element.get("<xmlattr>.name", std::string()));
    }
  } catch (const boost::property_tree::ptree_error& error) {
    refuse(std::string("the URDF is not XML: ") + error.what());
  }
  return names;
}

}  // namespace process_visualizer::joints
