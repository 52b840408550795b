// SPDX-License-Identifier: BSD-3-Clause
// Triangulation of basic shapes, even sampling of triangles, meshes from assimp.

#include "process_visualizer/cloud/surface.hpp"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <cmath>

#include "process_visualizer/cloud/require.hpp"
#include "process_visualizer/mesh/mesh_file.hpp"

namespace process_visualizer::cloud {
namespace {

constexpr int kSides = 48;  ///< of a round shape; a tube of 10 cm is within 0.1 mm of its circle

/// Adds a quadrilateral as two triangles; its corners are counterclockwise.
void addFace(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
             const Eigen::Vector3f& d, Surface& surface) {
  surface.push_back({a, b, c});
  surface.push_back({a, c, d});
}

/// A point of a round shape. `turn`, from 0 to kSides, is the angle about z; `height` is z.
Eigen::Vector3f onCircle(int turn, double radius, double height) {
  const double angle = 2.0 * M_PI * turn / kSides;
  return Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), height).cast<float>();
}

Surface scaled(Surface surface, const Eigen::Vector3f& size) {
  for (auto& triangle : surface)
    for (auto& corner : triangle) corner = corner.cwiseProduct(size);
  return surface;
}

/// Six times the volume inside a surface; negative if its triangles are clockwise.
double signedVolume(const Surface& surface) {
  double volume = 0.0;
  for (const auto& [a, b, c] : surface) volume += a.dot(b.cross(c));
  return volume;
}

/// A sequence that fills the unit square evenly; its k-th point is (k a, k b) mod 1 (M. Roberts,
/// The unreasonable effectiveness of quasirandom sequences, 2018: the sequence R2).
class EvenSequence {
 public:
  /// The next point, as weights of two edges of a triangle.
  Eigen::Vector2d next() {
    constexpr double kStepA = 0.7548776662466927, kStepB = 0.5698402909980532;
    a_ = std::fmod(a_ + kStepA, 1.0);
    b_ = std::fmod(b_ + kStepB, 1.0);
    return a_ + b_ > 1.0 ? Eigen::Vector2d(1.0 - a_, 1.0 - b_) : Eigen::Vector2d(a_, b_);
  }

 private:
  double a_ = 0.0, b_ = 0.0;
};

pcl::PointNormal pointOf(const Eigen::Vector3d& place, const Eigen::Vector3d& normal) {
  pcl::PointNormal point;
  point.getVector3fMap() = place.cast<float>();
  point.getNormalVector3fMap() = normal.cast<float>();
  return point;
}

}  // namespace

Surface boxSurface(const Eigen::Vector3f& size) {
  Surface surface;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-0.5F, 0.5F}) {
      const Eigen::Vector3f center = side * Eigen::Vector3f::Unit(axis);
      const Eigen::Vector3f u = 0.5F * Eigen::Vector3f::Unit((axis + 1) % 3);
      const Eigen::Vector3f v = (side > 0 ? 0.5F : -0.5F) * Eigen::Vector3f::Unit((axis + 2) % 3);
      addFace(center - u - v, center + u - v, center + u + v, center - u + v, surface);
    }
  }
  return scaled(std::move(surface), size);
}

Surface cylinderSurface(const Eigen::Vector3f& size) {
  Surface surface;
  const Eigen::Vector3f top(0, 0, 0.5F), bottom(0, 0, -0.5F);
  for (int i = 0; i < kSides; ++i) {
    const Eigen::Vector3f a = onCircle(i, 0.5, -0.5), b = onCircle(i + 1, 0.5, -0.5);
    const Eigen::Vector3f c = onCircle(i + 1, 0.5, 0.5), d = onCircle(i, 0.5, 0.5);
    addFace(a, b, c, d, surface);
    surface.push_back({top, d, c});
    surface.push_back({bottom, b, a});
  }
  return scaled(std::move(surface), size);
}

Surface sphereSurface(const Eigen::Vector3f& size) {
  Surface surface;
  const auto place = [](int turn, int rise) {
    const double angle = M_PI * rise / kSides - M_PI_2;
    return onCircle(turn, 0.5 * std::cos(angle), 0.5 * std::sin(angle));
  };
  for (int rise = 0; rise < kSides; ++rise)
    for (int turn = 0; turn < kSides; ++turn)
      addFace(place(turn, rise), place(turn + 1, rise), place(turn + 1, rise + 1),
              place(turn, rise + 1), surface);
  return scaled(std::move(surface), size);
}

void addPoints(const Surface& surface, const Eigen::Affine3d& pose, double spacing_m,
               SurfaceCloud& cloud) {
  const double outward = signedVolume(surface) * pose.linear().determinant() < 0.0 ? -1.0 : 1.0;
  EvenSequence sequence;
  double owed = 0.5;  // points that the triangles so far have not got yet
  for (const auto& triangle : surface) {
    const Eigen::Vector3d a = pose * triangle[0].cast<double>();
    const Eigen::Vector3d u = pose * triangle[1].cast<double>() - a;
    const Eigen::Vector3d v = pose * triangle[2].cast<double>() - a;
    const Eigen::Vector3d across = u.cross(v);
    if (!(across.norm() > 0.0) || !across.allFinite()) continue;
    const Eigen::Vector3d normal = outward * across.normalized();
    for (owed += across.norm() / (2.0 * spacing_m * spacing_m); owed >= 1.0; owed -= 1.0) {
      const Eigen::Vector2d weights = sequence.next();
      cloud.push_back(pointOf(a + weights.x() * u + weights.y() * v, normal));
    }
  }
}

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

namespace {

Eigen::Vector3f corner(const aiMatrix4x4& pose, const aiVector3D& vertex) {
  const aiVector3D placed = pose * vertex;
  return {placed.x, placed.y, placed.z};
}

void addMesh(const aiMesh& mesh, const aiMatrix4x4& pose, Surface& surface) {
  for (unsigned int i = 0; i < mesh.mNumFaces; ++i) {
    const aiFace& face = mesh.mFaces[i];
    if (face.mNumIndices != 3) continue;  // points and lines have no surface
    const Triangle triangle{corner(pose, mesh.mVertices[face.mIndices[0]]),
                            corner(pose, mesh.mVertices[face.mIndices[1]]),
                            corner(pose, mesh.mVertices[face.mIndices[2]])};
    const auto is_finite = [](const Eigen::Vector3f& it) { return it.allFinite(); };
    if (std::all_of(triangle.begin(), triangle.end(), is_finite)) surface.push_back(triangle);
  }
}

void addNode(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent,
             Surface& surface) {
  const aiMatrix4x4 pose = parent * node.mTransformation;
  for (unsigned int i = 0; i < node.mNumMeshes; ++i)
    addMesh(*scene.mMeshes[node.mMeshes[i]], pose, surface);
  for (unsigned int i = 0; i < node.mNumChildren; ++i)
    addNode(scene, *node.mChildren[i], pose, surface);
}

}  // namespace

Surface readSurface(const std::vector<std::uint8_t>& content, const std::string& name) {
  mesh::MeshReader reader;
  Surface surface;
  const aiScene& scene = reader.read(content, name, aiProcess_Triangulate);
  addNode(scene, *scene.mRootNode, aiMatrix4x4(), surface);
  require(!surface.empty(), "the mesh " + name + " has no triangles");
  return surface;
}

}  // namespace process_visualizer::cloud
