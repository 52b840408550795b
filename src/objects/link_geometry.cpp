// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/link_geometry.hpp"

#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <map>

#include "process_visualizer/cloud/require.hpp"
#include "process_visualizer/common/frame_name.hpp"

namespace process_visualizer::objects {
namespace {

Eigen::Affine3f toEigen(const urdf::Pose& pose) {
  double x, y, z, w;
  pose.rotation.getQuaternion(x, y, z, w);
  return Eigen::Affine3f(
      Eigen::Translation3f(
          Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z).cast<float>()) *
      Eigen::Quaterniond(w, x, y, z).normalized().cast<float>());
}

Eigen::Vector3f toEigen(const urdf::Vector3& vector) {
  return Eigen::Vector3d(vector.x, vector.y, vector.z).cast<float>();
}

TriangleMesh scaledMesh(const urdf::Mesh& mesh, const ReadResource& read) {
  TriangleMesh scaled;
  append(scaled, readMesh(read(mesh.filename), mesh.filename),
         Eigen::Affine3f(Eigen::Scaling(toEigen(mesh.scale))));
  return scaled;
}

TriangleMesh meshOf(const urdf::Geometry& geometry, const ReadResource& read) {
  switch (geometry.type) {
    case urdf::Geometry::BOX:
      return boxMesh(toEigen(dynamic_cast<const urdf::Box&>(geometry).dim));
    case urdf::Geometry::CYLINDER: {
      const auto& cylinder = dynamic_cast<const urdf::Cylinder&>(geometry);
      return cylinderMesh(static_cast<float>(cylinder.radius), static_cast<float>(cylinder.length));
    }
    case urdf::Geometry::SPHERE:
      return sphereMesh(static_cast<float>(dynamic_cast<const urdf::Sphere&>(geometry).radius));
    default:
      return scaledMesh(dynamic_cast<const urdf::Mesh&>(geometry), read);
  }
}

/// \param shapes  visuals or collisions
template <typename Shapes>
TriangleMesh meshOfAll(const Shapes& shapes, const ReadResource& read) {
  TriangleMesh mesh;
  for (const auto& shape : shapes)
    if (shape && shape->geometry)
      append(mesh, meshOf(*shape->geometry, read), toEigen(shape->origin));
  return mesh;
}

}  // namespace

std::vector<LinkGeometry> linkGeometries(const std::string& urdf, const ReadResource& read) {
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(urdf);
  cloud::require(model != nullptr, "it is not a robot description (URDF)");
  std::vector<LinkGeometry> geometries;
  for (const auto& [name, link] : model->links_) {
    TriangleMesh mesh = meshOfAll(link->visual_array, read);
    if (mesh.empty()) mesh = meshOfAll(link->collision_array, read);
    if (!mesh.empty()) geometries.push_back({withoutLeadingSlash(name), std::move(mesh)});
  }
  return geometries;
}

}  // namespace process_visualizer::objects
