// SPDX-License-Identifier: BSD-3-Clause
// The functions by which sewing_cell/mesh_picture.py makes pictures.

#include <algorithm>
#include <cstddef>

#include "depth_errors.hpp"
#include "picture.hpp"

extern "C" {

/// See sewing_cell::draw. \param camera_from_mesh  twelve numbers
void sewing_cell_draw(const sewing_cell::Mesh* mesh, const double* camera_from_mesh,
                      const sewing_cell::Picture* picture) {
  sewing_cell::Pose pose;
  std::copy_n(camera_from_mesh, pose.size(), pose.begin());
  sewing_cell::draw(*mesh, pose, *picture);
}

/// See sewing_cell::measureRow.
void sewing_cell_measure(int height, int width, const float* depth_m, const float* noise_steps,
                         std::uint16_t* depth_mm) {
  for (std::ptrdiff_t row = 0; row < height; ++row)
    sewing_cell::measureRow(width, depth_m + row * width, noise_steps + row * width,
                            depth_mm + row * width);
}

}  // extern "C"
