// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

namespace process_visualizer::recorder {

/// Returns the path of a new bag: FOLDER/NAME.bag, or with an empty name FOLDER/PREFIX_DATE.bag or
/// FOLDER/DATE.bag with the local date and time, which is numbered if there is one already.
/// \throws RecordingError if the name cannot be a file's, or there is such a bag already
std::string newBagPath(const std::string& folder, const std::string& prefix,
                       const std::string& name);

/// Returns the path of a part of a recording that is split: a.bag becomes a_0.bag, a_1.bag, ...
std::string partPath(const std::string& path, unsigned part);

/// Creates a folder with those above it. \throws RecordingError
void createFolder(const std::string& folder);

/// Returns how many bytes are free on a folder's disk. \throws RecordingError if these are too few
std::uint64_t requireRoom(const std::string& folder, std::uint64_t bytes);

}  // namespace process_visualizer::recorder
