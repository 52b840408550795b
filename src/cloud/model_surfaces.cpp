// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/cloud/model_surfaces.hpp"

#include <resource_retriever/retriever.h>

#include <stdexcept>
#include <string>
#include <vector>

namespace process_visualizer::cloud {
namespace {

using visualization_msgs::Marker;

Surface meshSurface(const std::string& address) {
  try {
    resource_retriever::Retriever retriever;
    const resource_retriever::MemoryResource file = retriever.get(address);
    const auto* begin = reinterpret_cast<const char*>(file.data.get());
    const std::size_t dot = address.rfind('.');
    return readSurface({begin, begin + file.size},
                       dot == std::string::npos ? "" : address.substr(dot + 1));
  } catch (const std::exception& error) {
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
      Surface surface = meshSurface(marker.mesh_resource);
      for (auto& triangle : surface)
        for (auto& corner : triangle) corner = corner.cwiseProduct(vectorOf(marker.scale));
      return surface;
    }
    default:
      throw std::invalid_argument("markers of type " + std::to_string(marker.type) +
                                  " have no surface");
  }
}

}  // namespace process_visualizer::cloud
