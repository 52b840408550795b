// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/hidden_place.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace process_visualizer::objects {
namespace {

using Eigen::Array3f;
using Eigen::Isometry3f;
using Eigen::Vector3f;

constexpr float kInner = 0.8F;      // of the box: its rim may be seen although the rest is hidden
constexpr std::size_t kStride = 7;  // of the points that are looked at; rows have other lengths

/// Which part of the way from one place through another one lies in a box around the origin, as
/// multiples of their distance; the second is smaller if there is none.
std::pair<float, float> partInside(const Vector3f& half, const Vector3f& from, const Vector3f& to) {
  const Array3f way = (to - from).array();
  const Array3f a = (-half - from).array() / way, b = (half - from).array() / way;
  return {a.min(b).maxCoeff(), a.max(b).minCoeff()};
}

}  // namespace

bool isHidden(const UprightBox& box, const Points& points, const std::vector<Label>& labels,
              const Isometry3f& global_from_cloud) {
  const Isometry3f box_from_cloud = Eigen::AngleAxisf(-box.yaw, Vector3f::UnitZ()) *
                                    Eigen::Translation3f(-box.center) * global_from_cloud;
  const Vector3f sensor = box_from_cloud.translation(), half = kInner / 2 * box.size;
  std::size_t hiding = 0, others = 0;
  for (std::size_t index = 0; index < labels.size(); index += kStride) {
    if (labels[index] == Label::kNowhere) continue;
    const auto [begin, end] = partInside(half, sensor, box_from_cloud * points.places[index]);
    if (!(begin < end && end > 0)) continue;
    const bool is_hiding = begin > 1 || (end > 1 && labels[index] == Label::kRobot);
    ++(is_hiding ? hiding : others);
  }
  return hiding > others;
}

}  // namespace process_visualizer::objects
