// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::objects {

/// The surface of a link of a model, in the link's frame.
struct LinkGeometry {
  std::string frame;
  cloud::Surface mesh;
};

/// Returns the bytes of a resource (`package://…`, `file://…`).
using ReadResource = std::function<std::vector<std::uint8_t>(const std::string& url)>;

/// The links of a robot description that have a shape: what is visible of them, which is what a
/// camera sees, or else their collision geometry.
/// \throws std::invalid_argument that says what is wrong with the description or one of its meshes
std::vector<LinkGeometry> linkGeometries(const std::string& urdf, const ReadResource& read);

}  // namespace process_visualizer::objects
