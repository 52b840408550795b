// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/cell_models.hpp"

#include <resource_retriever/retriever.h>
#include <ros/param.h>

#include "process_visualizer/cloud/require.hpp"
#include "process_visualizer/objects/link_geometry.hpp"

namespace process_visualizer::objects {
namespace {

std::vector<std::uint8_t> readResource(const std::string& url) {
  resource_retriever::Retriever retriever;
  const resource_retriever::MemoryResource resource = retriever.get(url);
  return {resource.data.get(), resource.data.get() + resource.size};
}

}  // namespace

std::vector<KnownBody> bodiesOf(const std::string& device, float reach, bool is_robot) {
  const std::string name = "/" + device + "/robot_description";
  std::string urdf;
  cloud::require(ros::param::get(name, urdf), "the parameter " + name + " is not set yet");
  std::vector<KnownBody> bodies;
  try {
    for (const LinkGeometry& link : linkGeometries(urdf, readResource))
      bodies.emplace_back(link.frame, link.mesh, reach, is_robot);
  } catch (const std::exception& error) {
    throw std::invalid_argument("the model in " + name + " cannot be used: " + error.what());
  }
  return bodies;
}

}  // namespace process_visualizer::objects
