// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Address of a mesh (package:// or file://): which ones are read, and their content.

#include <string>

#include "process_visualizer/mesh/mesh_file.hpp"

namespace process_visualizer::mesh {

/// Returns the content at the address of a mesh in a robot description or a marker:
/// `package://NAME/PATH` below that installed package, or `file:///PATH`. Anyone on the network
/// may have written the address; nothing is fetched from other computers.
/// \throws std::invalid_argument that names the address or its file, and says what is wrong
Bytes contentAt(const std::string& address);

}  // namespace process_visualizer::mesh
