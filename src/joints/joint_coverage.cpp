// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/joints/joint_coverage.hpp"

namespace process_visualizer::joints {
namespace {

constexpr std::chrono::seconds kPatience{3};

}  // namespace

JointCoverage::JointCoverage(const std::vector<std::string>& joint_names)
    : missing_(joint_names.begin(), joint_names.end()) {}

void JointCoverage::add(const std::vector<std::string>& names, Clock::time_point now) {
  if (!begun_) first_ = now;
  begun_ = true;
  for (const std::string& name : names) missing_.erase(name);
}

std::string JointCoverage::problem(Clock::time_point now) const {
  if (!begun_ || missing_.empty() || now - first_ < kPatience) return "";
  std::string names;
  for (const std::string& name : missing_) names += (names.empty() ? "" : ", ") + name;
  return "none says where " + names +
         " is, and what hangs on it is not drawn; name a topic that has all joints of the model";
}

}  // namespace process_visualizer::joints
