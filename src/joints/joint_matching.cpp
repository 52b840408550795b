// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/joints/joint_matching.hpp"

#include <algorithm>
#include <boost/property_tree/xml_parser.hpp>
#include <cmath>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace process_visualizer::joints {
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
    if (!std::isfinite(measured.positions[i])) {
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

std::vector<std::string> movableJoints(const std::string& urdf) {
  // as MOVABLE in robot/kinematics.py
  static const std::set<std::string> kMovable = {"revolute", "continuous", "prismatic"};
  std::vector<std::string> names;
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
