// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "process_visualizer/objects/triangle_mesh.hpp"

namespace process_visualizer::objects {

/// The surface of a link of a model, in the link's frame.
struct LinkGeometry {
  std::string frame;
  TriangleMesh mesh;
};

/// Returns the bytes of a resource (`package://…`, `file://…`).
using ReadResource = std::function<std::vector<std::uint8_t>(const std::string& url)>;

/// The links of a robot description that have a shape: what is visible of them, which is what a
/// camera sees, or else their collision geometry.
/// \throws std::invalid_argument that says what is wrong with the description or one of its meshes
std::vector<LinkGeometry> linkGeometries(const std::string& urdf, const ReadResource& read);

/// The triangles of a mesh file, in m, with the transforms of its nodes. As in RViz, the z axis of
/// a COLLADA file stays the z axis whatever it says.
/// \param name  of the file; its ending says what it is
/// \throws std::invalid_argument that says what is wrong with the file
TriangleMesh readMesh(const std::vector<std::uint8_t>& bytes, const std::string& name);

}  // namespace process_visualizer::objects
