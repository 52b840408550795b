// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace sewing_cell {

/// One row of a Kinect's depths: steps of the disparity, noise, shadows and holes.
///
/// What the projector cannot light has no depth: a pixel is in the shadow of one that is some
/// columns to the right if the disparity there is larger by more.
/// \param depth_m      true depths of the pixels
/// \param noise_steps  of the disparity; NaN: a hole
/// \param depth_mm     gets what is measured; 0: nothing
void measureRow(int width, const float* depth_m, const float* noise_steps, std::uint16_t* depth_mm);

}  // namespace sewing_cell
