// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/model_surfaces.hpp"

#include <resource_retriever/retriever.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace process_visualizer::cloud {
namespace {

using visualization_msgs::Marker;

std::vector<std::uint8_t> contentOf(const std::string& address) {
  try {
    resource_retriever::Retriever retriever;
    const resource_retriever::MemoryResource file = retriever.get(address);
    return {file.data.get(), file.data.get() + file.size};
  } catch (const resource_retriever::Exception& error) {
    throw std::invalid_argument(address + ": " + error.what());
  }
}

Eigen::Vector3f vectorOf(const geometry_msgs::Vector3& vector) {
  return Eigen::Vector3d(vector.x, vector.y, vector.z).cast<float>();
}

}  // namespace

Surface surfaceOf(const Marker& marker) {
  switch (marker.type) {
    case Marker::CUBE:
      return boxSurface(vectorOf(marker.scale));
    case Marker::CYLINDER:
      return cylinderSurface(vectorOf(marker.scale));
    case Marker::SPHERE:
      return sphereSurface(vectorOf(marker.scale));
    case Marker::MESH_RESOURCE: {
      Surface surface;
      append(surface, readSurface(contentOf(marker.mesh_resource), marker.mesh_resource),
             Eigen::Affine3f(Eigen::Scaling(vectorOf(marker.scale))));
      return surface;
    }
    default:
      throw std::invalid_argument("markers of type " + std::to_string(marker.type) +
                                  " have no surface");
  }
}

}  // namespace process_visualizer::cloud
