// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/box.hpp"

#include "process_visualizer/cloud/require.hpp"

namespace process_visualizer::cloud {

Box::Box(const Eigen::Vector3d& center, const Eigen::Vector3d& size)
    : center_(center), size_(size) {
  require(center.allFinite(), "center must be three finite numbers");
  require(size.allFinite() && (size.array() > 0).all(),
          "size must be three finite numbers greater than zero");
}

Eigen::Matrix<double, 3, 8> Box::corners() const {
  Eigen::Matrix<double, 3, 8> corners;
  for (int number = 0; number < 8; ++number) {
    const auto side = [number](int bit) { return (number & bit) != 0 ? 1.0 : -1.0; };
    corners.col(number) =
        center_ + Eigen::Vector3d(side(1), side(2), side(4)).cwiseProduct(halfExtents());
  }
  return corners;
}

}  // namespace process_visualizer::cloud
