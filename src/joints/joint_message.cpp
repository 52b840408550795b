// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/joints/joint_message.hpp"

#include <cstddef>
#include <stdexcept>

#include "process_visualizer/common/wire_reader.hpp"

namespace process_visualizer::joints {
namespace {

constexpr char kArray[] = "std_msgs/Float32MultiArray";
constexpr char kJointState[] = "sensor_msgs/JointState";
constexpr std::uint64_t kNsPerS = 1000000000;

/// std_msgs/Float32MultiArray: the elements behind the layout's data_offset.
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
    throw std::invalid_argument("its data_offset " + std::to_string(padding) + " is behind its " +
                                std::to_string(data.size()) + " elements");
  return {data.begin() + static_cast<std::ptrdiff_t>(padding), data.end()};
}

/// sensor_msgs/JointState.
StampedJoints stateValues(WireReader reader) {
  reader.number<std::uint32_t>();  // sequence number
  const auto seconds = reader.number<std::uint32_t>();
  const auto nanoseconds = reader.number<std::uint32_t>();
  reader.text();  // frame
  StampedJoints found;
  found.joints.names = reader.texts();
  found.joints.positions = reader.numbers<double>();
  reader.numbers<double>();  // velocities
  reader.numbers<double>();  // efforts
  reader.end();
  found.stamp_ns = seconds * kNsPerS + nanoseconds;
  return found;
}

}  // namespace

StampedJoints decodeJoints(const std::string& type, const std::vector<std::uint8_t>& bytes) {
  if (type != kArray && type != kJointState)
    throw std::invalid_argument("it carries " + type + ", and " + kArray + " or " + kJointState +
                                " is expected");
  try {
    if (type == kJointState) return stateValues(WireReader(bytes));
    return {{{}, arrayValues(WireReader(bytes))}, 0};
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("its bytes are not those of " + type + ": " + error.what());
  }
}

}  // namespace process_visualizer::joints
