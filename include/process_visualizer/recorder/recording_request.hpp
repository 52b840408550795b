// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Checks of a client's request to record: allowed folders, splitting, options and path of the bag.

#include <process_visualizer/StartRecording.h>
#include <ros/node_handle.h>
#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "process_visualizer/recorder/recording.hpp"

namespace process_visualizer::recorder {

/// The folders in which clients on the network may let the recorder write.
class AllowedFolders {
 public:
  explicit AllowedFolders(std::vector<std::string> folders) : folders_(std::move(folders)) {}

  /// Throws RecordingError unless a folder, with all links resolved, is one of these or below one.
  void check(const std::string& folder) const;

 private:
  std::vector<std::string> folders_;
};

/// Throws RecordingError for invalid limits of splitting: so small that every message would get a
/// file of its own, or not numbers. 0: never split.
void checkSplit(std::uint64_t bytes, double duration_s);

/// Throws RecordingError if this is not a valid duration [s] of the memory.
void checkRecent(double recent_s);

/// Returns a file mode mask written in octal, such as 0027. Throws RecordingError if it is invalid.
mode_t fileModeMask(const std::string& octal);

/// Returns the options for a requested recording; creates its folder.
/// \param node its private parameters are the defaults of the request
/// \param folder if the request names none
/// \param allowed allowed folders
/// \throws RecordingError if the request cannot be met
RecordingOptions optionsOf(const StartRecording::Request& request, const ros::NodeHandle& node,
                           const std::string& folder, const AllowedFolders& allowed);

/// Returns the path for a requested bag; creates its folder. There is no such file yet.
/// \throws RecordingError if such a bag cannot be created
std::string pathOf(const StartRecording::Request& request, const std::string& folder,
                   const AllowedFolders& allowed);

/// Returns the folders in which requests may let the recorder write: the default folder, those in
/// the environment, and those in the parameter ~folders; without the parameter, the user's home and
/// the folders for removable disks and temporary files.
AllowedFolders allowedFolders(const ros::NodeHandle& node, const std::string& folder);

/// Returns a parameter in megabytes as bytes.
std::uint64_t megabytes(const ros::NodeHandle& node, const std::string& parameter, int value);

}  // namespace process_visualizer::recorder
