// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

namespace process_visualizer::objects {

/// What is known about a point of a cloud.
enum class Label : std::uint8_t {
  kOutside,  ///< not a number, or not in the region that is looked at
  kKnown,    ///< on something that has a model, or that is expected
  kFree,     ///< on something that nobody modelled
};

/// The points of a cloud as an image: which point each pixel has, -1 for none.
struct PixelImage {
  std::size_t width = 0, height = 0;
  std::vector<std::int32_t> points;
};

/// The image of a cloud in rows, of that size.
PixelImage imageOf(std::size_t width, std::size_t height);

/// The image of any points in front of a camera, in its optical frame (z forward), m.
/// \param focal  its focal length, px
/// \return an image without pixels if there are no such points, or they are too far apart
PixelImage imageOf(const std::vector<Eigen::Vector3f>& points, double focal);

/// Labels as known what a camera makes up where a known body hides what is behind it: a pixel on
/// the edge sees both, and gets a depth between them. Such points lie behind pixels of the body, at
/// most two pixels aside, and hardly any of their neighbours is as far from the camera as they are.
void removeMixedPixels(const PixelImage& image, const std::vector<Eigen::Vector3f>& points,
                       std::vector<Label>& labels);

}  // namespace process_visualizer::objects
