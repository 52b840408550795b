// SPDX-License-Identifier: BSD-3-Clause
#include "depth_errors.hpp"

#include <algorithm>
#include <limits>

namespace sewing_cell {
namespace {

// Steps of 1/8 pixel at a focal length of 580 px and a baseline of 75 mm make a step of
// Z^2 * 2.87e-3 m: 1 cm at 1.9 m (Khoshelham and Elberink 2012, Sensors 12, eq. 5 and 10).
constexpr float kStepsPerPixel = 8.0F;
constexpr float kStepsM = kStepsPerPixel * 580.0F * 0.075F;
constexpr float kFewestSteps = 6.0F;  ///< 58 m; the depth in mm fits into 16 bits

/// Rounds a non-negative number to the nearest integer; std::lround is a call for each pixel.
float rounded(float value) {
  return static_cast<float>(
      static_cast<int>(value + 0.5F));  // NOLINT(bugprone-incorrect-roundings)
}

}  // namespace

void measureRow(int width, const float* depth_m, const float* noise_steps,
                std::uint16_t* depth_mm) {
  float nearest = -std::numeric_limits<float>::infinity();
  for (int column = width - 1; column >= 0; --column) {
    const float steps = kStepsM / depth_m[column];
    const float place = steps / kStepsPerPixel - static_cast<float>(column);
    const float measured = rounded(std::max(kFewestSteps, steps + noise_steps[column]));
    const bool is_seen = place >= nearest && noise_steps[column] == noise_steps[column];
    depth_mm[column] =
        is_seen ? static_cast<std::uint16_t>(rounded(1000.0F * kStepsM / measured)) : 0;
    nearest = std::max(nearest, place);
  }
}

}  // namespace sewing_cell
