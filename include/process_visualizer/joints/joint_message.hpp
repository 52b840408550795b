// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Joint positions in a driver's message: decoding, matching to a robot's joints, unusable values.

#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace process_visualizer::joints {

/// Maximum position of a joint [rad or m], as MAX_POSITION in Python.
constexpr double kMaxPosition = 1e6;

/// Positions [rad or m] of joints, by name; a driver's message may have no names.
struct JointPositions {
  std::vector<std::string> names;
  std::vector<double> positions;
  std::vector<std::string> unusable = {};  ///< joints with NaN or beyond kMaxPosition
};

/// The joints in a message, and its stamp [ns since 1970]; 0: it has none.
struct StampedJoints {
  JointPositions joints;
  std::uint64_t stamp_ns = 0;
};

/// Returns the joints in the bytes of a driver's message.
/// \throws std::invalid_argument if the type has no joints, or the bytes are not of that type
StampedJoints decodeJoints(const std::string& type, const std::vector<std::uint8_t>& bytes);

/// Error: a message has only joints of other robots, or no positions at all.
struct ForeignJoints : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// Finds the measured position of each joint of a robot.
class JointMatching {
 public:
  /// \param robot_name the driver's name 'elbow' also denotes the joint 'robot_name/elbow'
  /// \param joint_names the robot's joints, in the order of a message without names
  /// \param offsets [rad or m], by joint; added to the measured positions
  /// \param prefix with 'left_', the driver's name 'left_elbow' also denotes the joint 'elbow'
  /// \throws std::invalid_argument if an offset belongs to no joint
  JointMatching(const std::string& robot_name, std::vector<std::string> joint_names,
                const std::map<std::string, double>& offsets = {}, const std::string& prefix = "");

  /// The robot's joints, in the order of a message without names.
  const std::vector<std::string>& jointNames() const { return joint_names_; }

  /// Returns the positions of the robot's joints that are in a message.
  ///
  /// A joint whose position is NaN or beyond kMaxPosition is left out and named in `unusable`, as
  /// in the message, even if it is of another robot.
  ///
  /// \throws ForeignJoints if none of them is a joint of the robot, or it has no positions
  /// \throws std::invalid_argument if the positions do not match the joints; the text says why
  JointPositions match(const JointPositions& measured) const;

 private:
  struct Joint {
    std::string name;
    double offset;
  };

  JointPositions matchByOrder(const std::vector<double>& positions) const;
  JointPositions matchByName(const JointPositions& measured) const;

  std::vector<std::string> joint_names_;
  std::map<std::string, Joint> joints_;  ///< by a driver's names
};

/// Message about joints whose position is NaN or beyond kMaxPosition; empty if there are none.
std::string aboutUnusable(const std::vector<std::string>& joints);

/// Returns the names of the joints of a URDF that are measured, in the file's order: those that
/// move and do not mimic another one.
/// \throws std::invalid_argument if the text is not XML
std::vector<std::string> movableJoints(const std::string& urdf);

}  // namespace process_visualizer::joints
