// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <string>

#include "process_visualizer/common/complaint.hpp"

namespace process_visualizer {

/// What /diagnostics is told of a complaint: a warning while it holds, and once that all is well.
/// \param node    the name of the node that complains
/// \param about   what it complains of, such as a topic
/// \param device  the device to which that belongs
diagnostic_msgs::DiagnosticStatus statusOf(const Complaint& complaint, Complaint::Time now,
                                           const std::string& node, const std::string& about,
                                           const std::string& device);

}  // namespace process_visualizer
