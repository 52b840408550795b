// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/known_bodies.hpp"

#include <algorithm>
#include <cstddef>

namespace process_visualizer::objects {
namespace {

using Eigen::AlignedBox3f;
using Eigen::Isometry3f;
using Eigen::Vector3f;
using Eigen::Vector3i;

constexpr float kSmallestCell = 0.08F;  // m
constexpr float kMostCells = 64;        // along an axis
constexpr unsigned kWordBits = 64;

/// The box, parallel to the axes, around a transformed box.
AlignedBox3f transformed(const AlignedBox3f& box, const Isometry3f& transform) {
  const Vector3f center = transform * box.center();
  const Vector3f half = transform.linear().cwiseAbs() * (box.sizes() / 2);
  return {center - half, center + half};
}

}  // namespace

PosedBodies::PosedBodies(const std::vector<KnownBody>& bodies,
                         const std::vector<Isometry3f>& cloud_from_body)
    : bodies_(bodies),
      cloud_from_body_(cloud_from_body),
      words_((bodies.size() + kWordBits - 1) / kWordBits) {
  for (const Isometry3f& transform : cloud_from_body)
    body_from_cloud_.push_back(transform.inverse());
  layOut();
  for (std::size_t body = 0; body < bodies.size(); ++body) insert(body);
}

void PosedBodies::layOut() {
  for (std::size_t body = 0; body < bodies_.size(); ++body)
    bounds_.extend(transformed(bodies_[body].field.bounds(), cloud_from_body_[body]));
  if (bounds_.isEmpty() || !bounds_.sizes().allFinite()) return;
  cell_ = std::max(kSmallestCell, bounds_.sizes().maxCoeff() / kMostCells);
  count_ = (bounds_.sizes() / cell_).array().floor().cast<int>() + 1;
  masks_.assign(static_cast<std::size_t>(count_.prod()) * words_, 0);
}

/// Sets the body's bit in the cells that its box may touch: their centres lie in the box grown by
/// half a cell's diagonal.
void PosedBodies::insert(std::size_t body) {
  AlignedBox3f box = bodies_[body].field.bounds();
  const AlignedBox3f around = transformed(box, cloud_from_body_[body]);
  const float margin = 0.87F * cell_;
  box.min().array() -= margin;
  box.max().array() += margin;
  const auto cellOf = [this](const Vector3f& place) -> Vector3i {
    const Vector3i cell = ((place - bounds_.min()) / cell_).array().floor().cast<int>();
    return cell.cwiseMax(0).cwiseMin(count_ - Vector3i::Ones());
  };
  const Vector3i first = cellOf(around.min()), last = cellOf(around.max());
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        const Vector3f center = bounds_.min() + cell_ * (Vector3f(x, y, z).array() + 0.5F).matrix();
        if (!box.contains(body_from_cloud_[body] * center)) continue;
        const std::size_t cell = (std::size_t(z) * count_.y() + y) * count_.x() + x;
        masks_[cell * words_ + body / kWordBits] |= Word{1} << (body % kWordBits);
      }
    }
  }
}

const KnownBody* PosedBodies::covering(const Vector3f& place, float padding) const {
  if (masks_.empty() || !bounds_.contains(place)) return nullptr;
  const Vector3i at = ((place - bounds_.min()) / cell_)
                          .cast<int>()
                          .cwiseMin(count_.array().matrix() - Vector3i::Ones());
  const std::size_t cell = (std::size_t(at.z()) * count_.y() + at.y()) * count_.x() + at.x();
  for (std::size_t word = 0; word < words_; ++word) {
    for (Word mask = masks_[cell * words_ + word]; mask != 0; mask &= mask - 1) {
      const std::size_t body = word * kWordBits + __builtin_ctzll(mask);
      if (bodies_[body].field.distance(body_from_cloud_[body] * place) <= padding)
        return &bodies_[body];
    }
  }
  return nullptr;
}

}  // namespace process_visualizer::objects
