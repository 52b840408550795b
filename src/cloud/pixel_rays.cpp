// SPDX-License-Identifier: BSD-3-Clause
// Undistortion of pixels (plumb_bob), scaling to the image, and checks of the camera info.

#include "process_visualizer/cloud/pixel_rays.hpp"

#include <sensor_msgs/distortion_models.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "process_visualizer/cloud/require.hpp"

namespace process_visualizer::cloud {
namespace {

using sensor_msgs::CameraInfo;

constexpr int kMaxSteps = 100;       ///< of the search for a pixel's ray
constexpr double kTolerance = 1e-8;  ///< of a ray's slope: a few millionths of a pixel

constexpr double kMinDepth = 0.01;  ///< minimum depth of a corner with a pixel in the image, m
constexpr double kMargin = 2;       ///< around a range, for rounding, px

struct Pinhole {
  Eigen::Vector2d focal;   ///< px
  Eigen::Vector2d center;  ///< the principal point, px
};

/// A lens by the model plumb_bob, for slopes (x/z, y/z).
struct Distortion {
  double k1, k2, p1, p2, k3;

  double radial(const Eigen::Vector2d& slope) const {
    const double r2 = slope.squaredNorm();
    return 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  }

  Eigen::Vector2d tangential(const Eigen::Vector2d& slope) const {
    const double r2 = slope.squaredNorm();
    const double xy = slope.x() * slope.y();
    return {2 * p1 * xy + p2 * (r2 + 2 * slope.x() * slope.x()),
            p1 * (r2 + 2 * slope.y() * slope.y()) + 2 * p2 * xy};
  }

  /// Finds the slope that the lens maps to `seen`; NaN if there is none.
  Eigen::Vector2d undo(const Eigen::Vector2d& seen) const {
    Eigen::Vector2d slope = seen;
    for (int step = 0; step < kMaxSteps; ++step) {
      const Eigen::Vector2d shift = tangential(slope);
      const double scale = radial(slope);
      if ((scale * slope + shift - seen).norm() < kTolerance) return slope;
      slope = (seen - shift) / scale;
    }
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
};

bool hasDistortion(const CameraInfo& info) {
  return std::any_of(info.D.begin(), info.D.end(), [](double value) { return value != 0; });
}

Distortion readDistortion(const CameraInfo& info) {
  require(info.distortion_model == sensor_msgs::distortion_models::PLUMB_BOB,
          "the distortion model '" + info.distortion_model +
              "' is not supported, only plumb_bob is; use rectified images and set the parameter "
              "rectified");
  require(info.D.size() == 4 || info.D.size() == 5,
          "the camera info has " + std::to_string(info.D.size()) +
              " distortion coefficients D, but plumb_bob has 5");
  require(std::all_of(info.D.begin(), info.D.end(), [](double d) { return std::isfinite(d); }),
          "the camera info's distortion coefficients D are not all finite");
  return {info.D[0], info.D[1], info.D[2], info.D[3], info.D.size() == 5 ? info.D[4] : 0};
}

/// P of the camera info, or K if images are raw or there is no P.
Pinhole readPinhole(const CameraInfo& info, bool is_distorted) {
  if (is_distorted || info.P[0] == 0) return {{info.K[0], info.K[4]}, {info.K[2], info.K[5]}};
  return {{info.P[0], info.P[5]}, {info.P[2], info.P[6]}};
}

double atLeastOne(std::uint32_t binning) { return std::max<std::uint32_t>(binning, 1); }

/// The pinhole of images as sent by the camera: K and P are for its full resolution.
Pinhole asSent(Pinhole pinhole, const CameraInfo& info) {
  const Eigen::Array2d binning(atLeastOne(info.binning_x), atLeastOne(info.binning_y));
  pinhole.center -= Eigen::Vector2d(info.roi.x_offset, info.roi.y_offset);
  return {pinhole.focal.array() / binning, pinhole.center.array() / binning};
}

/// The size of images as sent by the camera, px; zero if the info does not have it.
Eigen::Vector2d sentSize(const CameraInfo& info) {
  const double width = info.roi.width != 0 ? info.roi.width : info.width;
  const double height = info.roi.height != 0 ? info.roi.height : info.height;
  return {width / atLeastOne(info.binning_x), height / atLeastOne(info.binning_y)};
}

Pinhole scaled(const Pinhole& pinhole, const CameraInfo& info, double width, double height) {
  const Eigen::Vector2d size = sentSize(info);
  if (size.isZero()) return pinhole;
  require(size.minCoeff() > 0, "the camera info's width or height is zero");
  const double scale = width / size.x();
  require(height <= size.y() * scale + 1,
          "the image has more rows than the camera info says: " + std::to_string(info.width) +
              " x " + std::to_string(info.height) + " px");
  return {pinhole.focal * scale, pinhole.center * scale};
}

void check(const Pinhole& pinhole) {
  require(pinhole.focal.allFinite() && pinhole.focal.minCoeff() > 0,
          "the camera info's focal lengths are not finite numbers greater than zero; is the camera "
          "calibrated?");
  require(pinhole.center.allFinite(), "the camera info's principal point is not finite");
}

/// A column or row, limited to those of the image and its end; the first one for NaN.
std::uint32_t pixelWithin(double place, std::uint32_t end) {
  return static_cast<std::uint32_t>(std::min<double>(std::max(0.0, place), end));
}

}  // namespace

PixelRays::PixelRays(const CameraInfo& info, std::uint32_t width, std::uint32_t height, Lens lens)
    : whole_{0, 0, width, height},
      is_distorted_(lens == Lens::kDistorts && hasDistortion(info)),
      width_(width),
      rays_(std::size_t{width} * height) {
  const Pinhole pinhole =
      scaled(asSent(readPinhole(info, is_distorted_), info), info, width, height);
  check(pinhole);
  focal_ = pinhole.focal;
  center_ = pinhole.center;
  // In float, as in depth_image_proc, so that points are equal to the last bit.
  const Eigen::Vector2f center = pinhole.center.cast<float>();
  for (std::size_t pixel = 0; pixel < rays_.size(); ++pixel)
    rays_[pixel] = Eigen::Vector2f(pixel % width, pixel / width) - center;
  if (!is_distorted_) return;
  const Distortion distortion = readDistortion(info);
  for (Eigen::Vector2f& ray : rays_) {
    const Eigen::Vector2d seen = ray.cast<double>().cwiseQuotient(focal_);
    ray = distortion.undo(seen).cwiseProduct(focal_).cast<float>();
  }
}

PixelRange PixelRays::rangeOf(const Eigen::Matrix<double, 3, 8>& corners) const {
  if (is_distorted_ || !(corners.row(2).minCoeff() > kMinDepth)) return whole_;
  const auto places =
      ((corners.colwise().hnormalized().array().colwise() * focal_.array()).colwise() +
       center_.array())
          .eval();
  return {pixelWithin(places.row(0).minCoeff() - kMargin, whole_.end_column),
          pixelWithin(places.row(1).minCoeff() - kMargin, whole_.end_row),
          pixelWithin(places.row(0).maxCoeff() + kMargin, whole_.end_column),
          pixelWithin(places.row(1).maxCoeff() + kMargin, whole_.end_row)};
}

}  // namespace process_visualizer::cloud
