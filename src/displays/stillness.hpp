// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

#include "label_layout.hpp"

namespace process_visualizer::displays {

/// Notices when points in the picture have come to rest. While they move, plates stay where they
/// are if they can; at rest they go where they would be without a past, so that the same scene is
/// the same picture, however one came there.
class Stillness {
 public:
  /// Takes the points of a picture, by key; `elapsed_s` since the last one.
  /// \returns true once for each rest, when it has lasted for a moment
  bool begins(const std::map<std::string, Point>& points, float elapsed_s);

 private:
  bool isAtRest(const std::map<std::string, Point>& points) const;

  std::map<std::string, Point> rest_;  ///< where they were when the rest began
  float rest_s_ = 0;
  bool has_begun_ = false;
};

}  // namespace process_visualizer::displays
