// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace sewing_cell {

/// One row of a Kinect's depths: steps of the disparity, noise, shadows and holes.
///
/// A pixel that the projector cannot light has no depth: it is in the shadow of a pixel some
/// columns to the right if the disparity there is larger by more than this number of columns.
/// \param depth_m      true depths of the pixels
/// \param noise_steps  noise of the disparity in steps; NaN: a hole
/// \param depth_mm     receives the measured depths; 0: none
void measureRow(int width, const float* depth_m, const float* noise_steps, std::uint16_t* depth_mm);

}  // namespace sewing_cell
