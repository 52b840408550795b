// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/partly_hidden.hpp"

#include <algorithm>
#include <cmath>

namespace process_visualizer::objects {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kAtSide = 0.02F;   // m: the points so near to a side tell whether it is hidden
constexpr float kOutwards = 0.6F;  // cosine: of directions that lead out of a side
constexpr int kFewestEnds = 3;     // that show a side
constexpr float kGrown = 0.02F;    // m: an object that reaches farther is larger than it was

/// Along one direction: what is seen, and how much more of its rim at either end is a real end than
/// is cut.
struct Extent {
  float least, most;
  int ends_at_least = 0, ends_at_most = 0;

  void add(float place, float outwards, bool is_cut) {
    if (place < least + kAtSide && outwards < -kOutwards) ends_at_least += is_cut ? -1 : 1;
    if (place > most - kAtSide && outwards > kOutwards) ends_at_most += is_cut ? -1 : 1;
  }
};

/// Where the whole begins and ends.
/// \param size  of the whole; a larger one that is seen is believed
Extent whole(const Extent& seen, float size, float expected_center) {
  const float length = seen.most - seen.least, half = size / 2;
  if (length > size + kGrown) return seen;
  const bool has_least = seen.ends_at_least >= kFewestEnds,
             has_most = seen.ends_at_most >= kFewestEnds;
  float center = (seen.least + seen.most) / 2;
  if (has_least != has_most)
    center = has_least ? seen.least + half : seen.most - half;
  else if (!has_least && length < size)
    center = std::clamp(expected_center, seen.most - half, seen.least + half);
  return {center - half, center + half};
}

/// The top is believed if it is about where it is expected, or higher: if it is lower, something
/// hides what is above.
float topOf(const UprightBox& expected, const UprightBox& seen) {
  const float known = expected.center.z() + expected.size.z() / 2;
  const float top = seen.center.z() + seen.size.z() / 2;
  return top > known - kAtSide ? top : known;
}

}  // namespace

UprightBox completed(const UprightBox& expected, const FoundObject& found) {
  const Eigen::Rotation2Df turned(-expected.yaw);
  const Eigen::AlignedBox2f seen = footprint(found.places, expected.yaw);
  Extent along{seen.min().x(), seen.max().x()}, across{seen.min().y(), seen.max().y()};
  for (const Rim& it : found.rim) {
    const Vector2f place = turned * Vector2f(it.place.head<2>());
    const Vector2f outwards = turned * Vector2f(it.outwards.head<2>());
    along.add(place.x(), outwards.x(), it.is_cut);
    across.add(place.y(), outwards.y(), it.is_cut);
  }
  const Vector2f center = turned * Vector2f(expected.center.head<2>());
  along = whole(along, expected.size.x(), center.x());
  across = whole(across, expected.size.y(), center.y());
  const Vector2f middle((along.least + along.most) / 2, (across.least + across.most) / 2);
  UprightBox box = expected;
  box.center.head<2>() = turned.inverse() * middle;
  box.center.z() = topOf(expected, found.box) - expected.size.z() / 2;
  box.size.head<2>() << along.most - along.least, across.most - across.least;
  return box;
}

}  // namespace process_visualizer::objects
