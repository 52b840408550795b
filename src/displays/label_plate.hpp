// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Appearance of a label's plate: readable colors, font size, and picture.

#include <QImage>
#include <string>
#include <vector>

namespace process_visualizer::displays {

/// An sRGB color, each component from 0 to 1.
struct Rgb {
  float red = 0;
  float green = 0;
  float blue = 0;
};

/// A plate; `opacity` from 0 to 1.
struct PlateStyle {
  Rgb color;
  Rgb behind;  ///< background that makes texts on the plate hardest to read: white or black
  float opacity = 0;
};

/// Contrast of two colors as in the guidelines for web content (WCAG), from 1 to 21.
float contrast(const Rgb& one, const Rgb& other);

/// The contrast that those guidelines require for small texts.
constexpr float kReadableContrast = 4.5F;

/// A dark plate for light texts, and vice versa.
PlateStyle plateFor(const std::vector<Rgb>& texts);

/// The color of the plate on its worst background.
Rgb worstBackground(const PlateStyle& plate);

/// The text's color, made lighter or darker as required for the contrast on every background.
Rgb readableOn(const PlateStyle& plate, Rgb text);

/// The size of a text, px. It falls gently with the distance, between a minimum and a maximum;
/// small changes are ignored.
///
/// @param projected height in the picture of a text in the scene, px
/// @param pixel_ratio pixels of the screen per pixel of the desktop, 1 without scaling
/// @param last size in the last picture; 0 if there was none
int fontSize(float projected, float pixel_ratio, int last);

/// A line on a plate; the text is UTF-8.
struct PlateLine {
  std::string text;
  Rgb color;
};

bool operator==(const PlateLine& one, const PlateLine& other);

/// The picture of a plate with its lines, as premultiplied ARGB. Its width is rounded up in steps,
/// so that the plate keeps its size while numbers on it change.
QImage paintPlate(const std::vector<PlateLine>& lines, int font_size_px);

}  // namespace process_visualizer::displays
