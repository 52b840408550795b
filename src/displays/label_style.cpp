// SPDX-License-Identifier: BSD-3-Clause
#include "label_style.hpp"

#include <algorithm>
#include <cmath>

namespace process_visualizer::displays {
namespace {

constexpr PlateStyle kDarkPlate{{0.07F, 0.08F, 0.10F}, {1, 1, 1}, 0.8F};
constexpr PlateStyle kLightPlate{{0.96F, 0.96F, 0.97F}, {0, 0, 0}, 0.85F};
constexpr float kMiddleLuminance = 0.18F;  ///< as far from white as from black, in contrast
constexpr int kSteps = 20;

constexpr float kSmallest = 13, kLargest = 22;
constexpr float kUnchanged = 16;  ///< at this height in the picture, a text has it on its plate
constexpr float kSmallestChange = 0.8F;

float linear(float part) {
  return part <= 0.04045F ? part / 12.92F : std::pow((part + 0.055F) / 1.055F, 2.4F);
}

float luminance(const Rgb& color) {
  return 0.2126F * linear(color.red) + 0.7152F * linear(color.green) + 0.0722F * linear(color.blue);
}

Rgb mixed(const Rgb& one, const Rgb& other, float part_of_other) {
  const auto mix = [&](float a, float b) { return a + part_of_other * (b - a); };
  return {mix(one.red, other.red), mix(one.green, other.green), mix(one.blue, other.blue)};
}

}  // namespace

float contrast(const Rgb& one, const Rgb& other) {
  const float a = luminance(one) + 0.05F, b = luminance(other) + 0.05F;
  return std::max(a, b) / std::min(a, b);
}

PlateStyle plateFor(const std::vector<Rgb>& texts) {
  float sum = 0;
  for (const Rgb& text : texts) sum += luminance(text);
  return sum >= kMiddleLuminance * static_cast<float>(texts.size()) ? kDarkPlate : kLightPlate;
}

Rgb worstBackground(const PlateStyle& plate) {
  return mixed(plate.behind, plate.color, plate.opacity);
}

Rgb readableOn(const PlateStyle& plate, Rgb text) {
  const Rgb background = worstBackground(plate);
  for (int i = 0; i <= kSteps; ++i) {
    const Rgb color = mixed(text, plate.behind, static_cast<float>(i) / kSteps);
    if (contrast(color, background) >= kReadableContrast) return color;
  }
  return plate.behind;
}

int fontSize(float projected, float pixel_ratio, int last) {
  const float height = std::sqrt(std::max(projected / pixel_ratio, 0.0F) * kUnchanged);
  const float size = pixel_ratio * std::clamp(height, kSmallest, kLargest);
  const bool hardly_changes = std::abs(size - static_cast<float>(last)) < kSmallestChange;
  return hardly_changes ? last : static_cast<int>(std::lround(size));
}

}  // namespace process_visualizer::displays
