// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

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

}  // namespace process_visualizer::recorder
