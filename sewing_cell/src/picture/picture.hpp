// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace sewing_cell {

using Vector = std::array<double, 3>;

/// A pinhole camera's picture, row by row. The depth is in m, along the camera's z axis; the color
/// has three bytes for each pixel.
struct Picture {
  int width, height;
  double focal_px, centre_u, centre_v;
  float* depth_m;
  std::uint8_t* colour;
};

/// Triangles, counterclockwise as seen from outside: nine coordinates (m) and three bytes of color
/// for each.
struct Mesh {
  std::size_t count;
  const float* corners;
  const std::uint8_t* colours;
};

/// A rigid transform: the upper three rows of its matrix, row by row.
using Pose = std::array<double, 12>;

/// Draws a mesh where it is nearer than the picture's depth. Triangles that the camera sees from
/// behind, or that extend behind it, are left out.
/// \param camera_from_mesh  x to the right, y down, z forward in the camera
void draw(const Mesh& mesh, const Pose& camera_from_mesh, const Picture& picture);

}  // namespace sewing_cell
