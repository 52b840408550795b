// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Places of label plates in the picture: where each goes, and when all are placed anew.

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace process_visualizer::displays {

/// A point of the picture, px: x to the right and y down from the upper left corner.
struct Point {
  float x = 0;
  float y = 0;
};

/// px
struct Size {
  float width = 0;
  float height = 0;
};

/// px; `corner` is the upper left one.
struct Rect {
  Point corner;
  Size size;
};

/// Returns the anchor if it is in the picture, otherwise a place at the top of the picture.
Point anchorOrTop(const std::optional<Point>& anchor, Size view);

/// Part of the picture that a plate should not cover. `weight` is the distance, in px, that a plate
/// may move to avoid complete overlap (of the smaller of the two).
struct Obstacle {
  Rect rect;
  float weight = 0;
};

/// A plate to be placed. `offset` is its place in the last picture, px from the anchor to its
/// middle.
struct LabelBox {
  Point anchor;
  Size size;
  std::optional<Point> offset;
};

/// Returns the offset of each plate from its anchor. A plate is centered on its anchor unless it
/// would cover an earlier plate of the list, or obstacles that are worth the distance. It keeps its
/// place from the last picture unless another one is clearly better. All plates are kept in the
/// view, as far as there is room.
std::vector<Point> chooseOffsets(const std::vector<LabelBox>& labels,
                                 const std::vector<Obstacle>& obstacles, Size view);

/// Places of plates over successive pictures: plates glide instead of jumping.
class LabelLayout {
 public:
  struct Plate {
    std::string key;  ///< the same from picture to picture
    Point anchor;
    Size size;
  };

  /// Returns the rectangle of each plate; `elapsed_s` since the last picture. `from_scratch`:
  /// disregards former places.
  std::vector<Rect> place(const std::vector<Plate>& plates, const std::vector<Obstacle>& obstacles,
                          Size view, float elapsed_s, bool from_scratch = false);

 private:
  struct Offset {
    Point chosen;
    Point shown;
  };

  Offset glide(const std::string& key, Point chosen, float elapsed_s) const;

  std::map<std::string, Offset> offsets_;
};

/// Detects when points in the picture have come to rest. While they move, plates keep their places
/// if they can; at rest, plates are placed anew, so that the same scene always gives the same
/// picture.
class Stillness {
 public:
  /// Processes the points of a picture, by key; `elapsed_s` since the last one.
  /// \returns true once per rest, when it has lasted for a moment
  bool begins(const std::map<std::string, Point>& points, float elapsed_s);

 private:
  bool isAtRest(const std::map<std::string, Point>& points) const;

  std::map<std::string, Point> rest_;  ///< positions when the rest began
  float rest_s_ = 0;
  bool has_begun_ = false;
};

}  // namespace process_visualizer::displays
