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

cloud::Surface scaledMesh(const urdf::Mesh& mesh, const ReadResource& read) {
  cloud::Surface scaled;
  cloud::append(scaled, cloud::readSurface(read(mesh.filename), mesh.filename),
                Eigen::Affine3f(Eigen::Scaling(toEigen(mesh.scale))));
  return scaled;
}

cloud::Surface surfaceOf(const urdf::Geometry& geometry, const ReadResource& read) {
  switch (geometry.type) {
    case urdf::Geometry::BOX:
      return cloud::boxSurface(toEigen(dynamic_cast<const urdf::Box&>(geometry).dim));
    case urdf::Geometry::CYLINDER: {
      const auto& cylinder = dynamic_cast<const urdf::Cylinder&>(geometry);
      const Eigen::Vector3d size(2 * cylinder.radius, 2 * cylinder.radius, cylinder.length);
      return cloud::cylinderSurface(size.cast<float>());
    }
    case urdf::Geometry::SPHERE: {
      const double diameter = 2 * dynamic_cast<const urdf::Sphere&>(geometry).radius;
      return cloud::sphereSurface(Eigen::Vector3f::Constant(static_cast<float>(diameter)));
    }
    default:
      return scaledMesh(dynamic_cast<const urdf::Mesh&>(geometry), read);
  }
}

/// \param shapes  visuals or collisions
template <typename Shapes>
cloud::Surface surfaceOfAll(const Shapes& shapes, const ReadResource& read) {
  cloud::Surface surface;
  for (const auto& shape : shapes)
    if (shape && shape->geometry)
      cloud::append(surface, surfaceOf(*shape->geometry, read), toEigen(shape->origin));
  return surface;
}

}  // namespace

std::vector<LinkGeometry> linkGeometries(const std::string& urdf, const ReadResource& read) {
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(urdf);
  cloud::require(model != nullptr, "it is not a robot description (URDF)");
  std::vector<LinkGeometry> geometries;
  for (const auto& [name, link] : model->links_) {
    cloud::Surface mesh = surfaceOfAll(link->visual_array, read);
    if (mesh.empty()) mesh = surfaceOfAll(link->collision_array, read);
    if (!mesh.empty()) geometries.push_back({withoutLeadingSlash(name), std::move(mesh)});
  }
  return geometries;
}

}  // namespace process_visualizer::objects
