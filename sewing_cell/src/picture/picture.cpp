// SPDX-License-Identifier: BSD-3-Clause
#include "picture.hpp"

#include <algorithm>
#include <cmath>

namespace sewing_cell {
namespace {

constexpr double kNearest = 0.1;   ///< m; a Kinect sees nothing nearer
constexpr double kAmbient = 0.55;  ///< brightness of a surface seen edge-on
constexpr double kOnEdge = 1e-6;   ///< px; pixels between two triangles must not fall through

Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector moved(const Pose& pose, const Vector& point) {
  Vector result;
  for (std::size_t row = 0; row < 3; ++row)
    result[row] = pose[4 * row] * point[0] + pose[4 * row + 1] * point[1] +
                  pose[4 * row + 2] * point[2] + pose[4 * row + 3];
  return result;
}

/// Returns the camera's position in the mesh's frame.
Vector eyeOf(const Pose& pose) {
  Vector eye;
  for (int axis = 0; axis < 3; ++axis)
    eye[axis] = -(pose[axis] * pose[3] + pose[4 + axis] * pose[7] + pose[8 + axis] * pose[11]);
  return eye;
}

/// A linear function of the pixel.
struct Plane {
  double along_u, along_v, constant;

  double at(double u, double v) const { return along_u * u + along_v * v + constant; }
};

/// The pixels of a row from one column to another.
struct Span {
  double first, last;

  /// Keeps the pixels where a plane is positive.
  void cut(const Plane& plane, double v) {
    const double rest = plane.along_v * v + plane.constant;
    if (plane.along_u > 0.0)
      first = std::max(first, -rest / plane.along_u - kOnEdge);
    else if (plane.along_u < 0.0)
      last = std::min(last, -rest / plane.along_u + kOnEdge);
    else if (rest < 0.0)
      last = -1.0;
  }
};

/// A triangle in the picture: u and v of its corners [px] and the inverse of their depths [1/m],
/// which is linear in the picture.
class Seen {
 public:
  Seen(const std::array<Vector, 3>& corners, const Picture& picture) {
    for (int i = 0; i < 3; ++i) {
      const double inverse = 1.0 / corners[i][2];
      at_[i] = {picture.centre_u + picture.focal_px * corners[i][0] * inverse,
                picture.centre_v + picture.focal_px * corners[i][1] * inverse, inverse};
    }
    for (int axis = 0; axis < 2; ++axis) {
      const auto [low, high] = std::minmax({at_[0][axis], at_[1][axis], at_[2][axis]});
      const int size = axis == 0 ? picture.width : picture.height;
      first_[axis] = static_cast<int>(std::ceil(std::max(low, 0.0)));
      last_[axis] = static_cast<int>(std::floor(std::min(high, size - 1.0)));
    }
  }

  bool hasPixels() const { return first_[0] <= last_[0] && first_[1] <= last_[1]; }

  void fill(const Picture& picture, const std::array<std::uint8_t, 3>& colour) const {
    const double area = edge(0, 1).at(at_[2][0], at_[2][1]);
    if (!(std::abs(area) > 0.0)) return;
    std::array<Plane, 3> weights;  // of the corner opposite to each edge, 1 at that corner
    for (int i = 0; i < 3; ++i) weights[i] = scaled(edge((i + 1) % 3, (i + 2) % 3), 1.0 / area);
    const Plane inverse = inverseDepth(weights);
    for (int row = first_[1]; row <= last_[1]; ++row) {
      Span span{static_cast<double>(first_[0]), static_cast<double>(last_[0])};
      for (const Plane& weight : weights) span.cut(weight, row);
      fillRow(picture, row, span, inverse, colour);
    }
  }

 private:
  /// Returns twice the area of the triangle of two corners and a pixel.
  Plane edge(int from, int to) const {
    const double u = at_[to][0] - at_[from][0], v = at_[to][1] - at_[from][1];
    return {-v, u, v * at_[from][0] - u * at_[from][1]};
  }

  static Plane scaled(const Plane& plane, double factor) {
    return {plane.along_u * factor, plane.along_v * factor, plane.constant * factor};
  }

  Plane inverseDepth(const std::array<Plane, 3>& weights) const {
    Plane sum{0.0, 0.0, 0.0};
    for (int i = 0; i < 3; ++i) {
      const Plane part = scaled(weights[i], at_[i][2]);
      sum = {sum.along_u + part.along_u, sum.along_v + part.along_v, sum.constant + part.constant};
    }
    return sum;
  }

  static void fillRow(const Picture& picture, int row, const Span& span, const Plane& inverse,
                      const std::array<std::uint8_t, 3>& colour) {
    const int last = static_cast<int>(std::floor(span.last));
    for (int column = static_cast<int>(std::ceil(span.first)); column <= last; ++column) {
      const std::size_t pixel = static_cast<std::size_t>(row) * picture.width + column;
      const auto depth = static_cast<float>(1.0 / inverse.at(column, row));
      if (!(depth < picture.depth_m[pixel])) continue;
      picture.depth_m[pixel] = depth;
      std::copy(colour.begin(), colour.end(), picture.colour + 3 * pixel);
    }
  }

  std::array<Vector, 3> at_;
  std::array<int, 2> first_, last_;  ///< column and row
};

/// Returns the brightness of a triangle: the more it faces the camera, the brighter it is.
std::array<std::uint8_t, 3> lit(const std::uint8_t* colour, const std::array<Vector, 3>& corners) {
  const Vector normal = cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]));
  const double facing = std::abs(normal[2]) / std::sqrt(dot(normal, normal));
  const double light = kAmbient + (1.0 - kAmbient) * facing;
  std::array<std::uint8_t, 3> shade;
  for (int i = 0; i < 3; ++i) shade[i] = static_cast<std::uint8_t>(light * colour[i]);
  return shade;
}

std::array<Vector, 3> triangle(const float* corners) {
  return {Vector{corners[0], corners[1], corners[2]}, Vector{corners[3], corners[4], corners[5]},
          Vector{corners[6], corners[7], corners[8]}};
}

}  // namespace

void draw(const Mesh& mesh, const Pose& camera_from_mesh, const Picture& picture) {
  const Vector eye = eyeOf(camera_from_mesh);
  for (std::size_t i = 0; i < mesh.count; ++i) {
    std::array<Vector, 3> corners = triangle(mesh.corners + 9 * i);
    const Vector normal = cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]));
    if (!(dot(normal, minus(eye, corners[0])) > 0.0)) continue;
    for (Vector& corner : corners) corner = moved(camera_from_mesh, corner);
    if (std::min({corners[0][2], corners[1][2], corners[2][2]}) < kNearest) continue;
    const Seen seen(corners, picture);
    if (seen.hasPixels()) seen.fill(picture, lit(mesh.colours + 3 * i, corners));
  }
}

}  // namespace sewing_cell
