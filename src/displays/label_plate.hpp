// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <QImage>
#include <string>
#include <vector>

namespace process_visualizer::displays {

/// A color of the screen (sRGB), each part from 0 to 1.
struct Rgb {
  float red = 0;
  float green = 0;
  float blue = 0;
};

/// A plate; `opacity` from 0 to 1.
struct PlateStyle {
  Rgb color;
  Rgb behind;  ///< what makes a text on the plate hardest to read: white or black
  float opacity = 0;
};

/// Contrast of two colors as in the guidelines for web content (WCAG), from 1 to 21.
float contrast(const Rgb& one, const Rgb& other);

/// The contrast that those guidelines ask for, for small texts.
constexpr float kReadableContrast = 4.5F;

/// A dark plate for light texts, and the other way round.
PlateStyle plateFor(const std::vector<Rgb>& texts);

/// The color of the plate over the background on which a text is hardest to read.
Rgb worstBackground(const PlateStyle& plate);

/// The text's color, as much lighter or darker as the contrast needs on every background.
Rgb readableOn(const PlateStyle& plate, Rgb text);

/// The size of a text, px: that of its height in the scene where that is readable; it falls gently
/// with distance, and stays between a smallest and a largest size. Where the size hardly changes,
/// it stays as it was.
///
/// @param projected height of the text in the picture, as it stands in the scene, px
/// @param pixel_ratio pixels of the screen for each of the desktop's, 1 if it is not scaled
/// @param last size in the last picture; 0 if there was none
int fontSize(float projected, float pixel_ratio, int last);

/// A line on a plate; the text is UTF-8.
struct PlateLine {
  std::string text;
  Rgb color;
};

bool operator==(const PlateLine& one, const PlateLine& other);

/// The picture of a plate with its lines, as premultiplied ARGB. Its width grows in steps, so that
/// a plate keeps its size while its numbers change.
QImage paintPlate(const std::vector<PlateLine>& lines, int font_size_px);

}  // namespace process_visualizer::displays
