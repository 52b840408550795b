// SPDX-License-Identifier: BSD-3-Clause
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>

#include "process_visualizer/cloud/require.hpp"
#include "process_visualizer/cloud/surface.hpp"

namespace process_visualizer::cloud {
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
  Assimp::Importer importer;
  // As RViz does: the unit of a Collada file counts, its upper axis does not.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const std::string extension = name.substr(name.rfind('.') + 1);
  const aiScene* scene = importer.ReadFileFromMemory(content.data(), content.size(),
                                                     aiProcess_Triangulate, extension.c_str());
  require(scene != nullptr && scene->mRootNode != nullptr,
          "the mesh " + name + " cannot be read: " + importer.GetErrorString());
  Surface surface;
  addNode(*scene, *scene->mRootNode, aiMatrix4x4(), surface);
  require(!surface.empty(), "the mesh " + name + " has no triangles");
  return surface;
}

}  // namespace process_visualizer::cloud
