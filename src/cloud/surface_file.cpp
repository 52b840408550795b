// SPDX-License-Identifier: BSD-3-Clause
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <stdexcept>

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
    surface.push_back({corner(pose, mesh.mVertices[face.mIndices[0]]),
                       corner(pose, mesh.mVertices[face.mIndices[1]]),
                       corner(pose, mesh.mVertices[face.mIndices[2]])});
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

Surface readSurface(const std::vector<char>& content, const std::string& extension) {
  Assimp::Importer importer;
  // As RViz does: the unit of a Collada file counts, its upper axis does not.
  importer.SetPropertyBool("IMPORT_COLLADA_IGNORE_UP_DIRECTION", true);
  const aiScene* scene = importer.ReadFileFromMemory(content.data(), content.size(),
                                                     aiProcess_Triangulate, extension.c_str());
  if (scene == nullptr || scene->mRootNode == nullptr)
    throw std::invalid_argument(importer.GetErrorString());
  Surface surface;
  addNode(*scene, *scene->mRootNode, aiMatrix4x4(), surface);
  if (surface.empty()) throw std::invalid_argument("it has no triangles");
  return surface;
}

}  // namespace process_visualizer::cloud
