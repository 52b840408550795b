// SPDX-License-Identifier: BSD-3-Clause
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>

#include "process_visualizer/cloud/require.hpp"
#include "process_visualizer/objects/link_geometry.hpp"

namespace process_visualizer::objects {
namespace {

Eigen::Affine3f toEigen(const aiMatrix4x4& matrix) {
  Eigen::Affine3f transform;
  transform.matrix() << matrix.a1, matrix.a2, matrix.a3, matrix.a4, matrix.b1, matrix.b2, matrix.b3,
      matrix.b4, matrix.c1, matrix.c2, matrix.c3, matrix.c4, matrix.d1, matrix.d2, matrix.d3,
      matrix.d4;
  return transform;
}

TriangleMesh trianglesOf(const aiMesh& mesh) {
  const auto corner = [&](unsigned index) {
    const aiVector3D& place = mesh.mVertices[index];
    return Eigen::Vector3f(place.x, place.y, place.z);
  };
  TriangleMesh triangles;
  for (unsigned number = 0; number < mesh.mNumFaces; ++number) {
    const aiFace& face = mesh.mFaces[number];
    if (face.mNumIndices != 3) continue;  // lines and points have no surface
    const Triangle triangle{corner(face.mIndices[0]), corner(face.mIndices[1]),
                            corner(face.mIndices[2])};
    if (triangle.a.allFinite() && triangle.b.allFinite() && triangle.c.allFinite())
      triangles.push_back(triangle);
  }
  return triangles;
}

void addNode(TriangleMesh& triangles, const aiScene& scene, const aiNode& node,
             const Eigen::Affine3f& parent) {
  const Eigen::Affine3f transform = parent * toEigen(node.mTransformation);
  for (unsigned number = 0; number < node.mNumMeshes; ++number)
    append(triangles, trianglesOf(*scene.mMeshes[node.mMeshes[number]]), transform);
  for (unsigned number = 0; number < node.mNumChildren; ++number)
    addNode(triangles, scene, *node.mChildren[number], transform);
}

}  // namespace

TriangleMesh readMesh(const std::vector<std::uint8_t>& bytes, const std::string& name) {
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const std::string ending = name.substr(name.rfind('.') + 1);
  const aiScene* scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(),
                                                     aiProcess_Triangulate, ending.c_str());
  cloud::require(scene != nullptr && scene->mRootNode != nullptr,
                 "the mesh " + name + " cannot be read: " + importer.GetErrorString());
  TriangleMesh triangles;
  addNode(triangles, *scene, *scene->mRootNode, Eigen::Affine3f::Identity());
  cloud::require(!triangles.empty(), "the mesh " + name + " has no triangles");
  return triangles;
}

}  // namespace process_visualizer::objects
