// SPDX-License-Identifier: BSD-3-Clause
#include "stillness.hpp"

#include <algorithm>
#include <cmath>

namespace process_visualizer::displays {
namespace {

constexpr float kShortestRest = 0.25F;  ///< s
constexpr float kTremble = 1.5F;        ///< px; a robot that stands trembles a little

}  // namespace

bool Stillness::begins(const std::map<std::string, Point>& points, float elapsed_s) {
  if (!isAtRest(points)) {
    rest_ = points;
    rest_s_ = 0;
    has_begun_ = false;
    return false;
  }
  rest_s_ += elapsed_s;
  const bool begins = !has_begun_ && rest_s_ >= kShortestRest;
  has_begun_ = has_begun_ || begins;
  return begins;
}

bool Stillness::isAtRest(const std::map<std::string, Point>& points) const {
  return std::equal(
      points.begin(), points.end(), rest_.begin(), rest_.end(), [](const auto& a, const auto& b) {
        return a.first == b.first &&
               std::hypot(a.second.x - b.second.x, a.second.y - b.second.y) <= kTremble;
      });
}

}  // namespace process_visualizer::displays
