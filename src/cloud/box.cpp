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

}  // namespace process_visualizer::cloud
