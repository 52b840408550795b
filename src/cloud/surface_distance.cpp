// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::cloud {

void append(Surface& surface, const Surface& added, const Eigen::Affine3f& transform) {
  surface.reserve(surface.size() + added.size());
  for (const auto& [a, b, c] : added)
    surface.push_back({transform * a, transform * b, transform * c});
}

Eigen::Vector3f closestPoint(const Triangle& triangle, const Eigen::Vector3f& point) {
  const auto& [a, b, c] = triangle;
  const Eigen::Vector3f ab = b - a, ac = c - a, ap = point - a;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Eigen::Vector3f bp = point - b;
  const float d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const float on_ab = d1 * d4 - d3 * d2;
  if (on_ab <= 0 && d1 >= 0 && d3 <= 0)
    return d1 == d3 ? a : Eigen::Vector3f(a + ab * (d1 / (d1 - d3)));
  const Eigen::Vector3f cp = point - c;
  const float d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const float on_ac = d5 * d2 - d1 * d6;
  if (on_ac <= 0 && d2 >= 0 && d6 <= 0)
    return d2 == d6 ? a : Eigen::Vector3f(a + ac * (d2 / (d2 - d6)));
  const float on_bc = d3 * d6 - d5 * d4, along = d4 - d3, back = d5 - d6;
  if (on_bc <= 0 && along >= 0 && back >= 0)
    return along + back == 0 ? b : Eigen::Vector3f(b + (c - b) * (along / (along + back)));
  const float whole = on_bc + on_ac + on_ab;
  return a + ab * (on_ac / whole) + ac * (on_ab / whole);
}

Eigen::AlignedBox3f boundsOf(const Surface& surface) {
  Eigen::AlignedBox3f bounds;
  for (const auto& [a, b, c] : surface) bounds.extend(a).extend(b).extend(c);
  return bounds;
}

std::vector<Eigen::Vector3f> samplesOf(const Surface& surface, float spacing_m) {
  std::vector<Eigen::Vector3f> samples;
  for (const auto& [a, b, c] : surface) {
    const float longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const int steps = std::max(1, static_cast<int>(std::ceil(longest / spacing_m)));
    for (int i = 0; i <= steps; ++i)
      for (int j = 0; i + j <= steps; ++j)
        samples.emplace_back(a + (b - a) * (static_cast<float>(i) / steps) +
                             (c - a) * (static_cast<float>(j) / steps));
  }
  return samples;
}

}  // namespace process_visualizer::cloud
