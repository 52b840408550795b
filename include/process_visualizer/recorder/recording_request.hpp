// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <process_visualizer/StartRecording.h>
#include <ros/node_handle.h>

#include <string>

#include "process_visualizer/recorder/recording.hpp"
#include "process_visualizer/recorder/recording_limits.hpp"

namespace process_visualizer::recorder {

/// Returns the options for a recording that is asked for; creates its folder.
/// \param node its private parameters say what the request leaves open
/// \param folder where the request names none
/// \param allowed where it may be
/// \throws RecordingError if the request cannot be met
RecordingOptions optionsOf(const StartRecording::Request& request, const ros::NodeHandle& node,
                           const std::string& folder, const AllowedFolders& allowed);

/// Returns the path for a bag that is asked for; creates its folder. It is free until somebody else
/// creates such a file.
/// \throws RecordingError if there cannot be such a bag
std::string pathOf(const StartRecording::Request& request, const std::string& folder,
                   const AllowedFolders& allowed);

/// Returns the folders in which requests may let the recorder write: those of the parameter
/// ~folders, or the user's own, those for removable disks and temporary files, and those of the
/// environment; and always the default folder.
AllowedFolders allowedFolders(const ros::NodeHandle& node, const std::string& folder);

/// Returns a parameter in megabytes as bytes.
std::uint64_t megabytes(const ros::NodeHandle& node, const std::string& parameter, int value);

}  // namespace process_visualizer::recorder
