// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <QImage>
#include <string>
#include <vector>

#include "label_style.hpp"

namespace process_visualizer::displays {

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
