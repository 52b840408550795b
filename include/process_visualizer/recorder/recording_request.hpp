// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <process_visualizer/StartRecording.h>
#include <ros/node_handle.h>
#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "process_visualizer/recorder/recording.hpp"

namespace process_visualizer::recorder {

/// The folders in which somebody in the network may let the recorder write.
class AllowedFolders {
 public:
  explicit AllowedFolders(std::vector<std::string> folders) : folders_(std::move(folders)) {}

  /// Throws RecordingError if a folder is none of these, and below none of them, when all links are
  /// followed.
  void check(const std::string& folder) const;

 private:
  std::vector<std::string> folders_;
};

/// Throws RecordingError if a recording could not be split like that: at sizes in bytes or times in
/// s that make a file of every message, or are no numbers. 0 is never.
void checkSplit(std::uint64_t bytes, double duration_s);

/// Throws RecordingError if this is no time [s] that may be wanted of the memory.
void checkRecent(double recent_s);

/// Returns a file mode mask written in octal, such as 0027. Throws RecordingError if it is none.
mode_t fileModeMask(const std::string& octal);

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
