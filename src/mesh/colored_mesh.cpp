// SPDX-License-Identifier: BSD-3-Clause
// A mesh file as triangles with normals and colors, for process_visualizer/robot/visuals.py. It is
// read by assimp, as in RViz, so both see the same mesh.

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <exception>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "process_visualizer/mesh/mesh_file.hpp"

namespace {

using process_visualizer::mesh::checkMesh;
using process_visualizer::mesh::contentOf;
using process_visualizer::mesh::MeshReader;

constexpr float kSmoothUpToDegrees = 35.0F;

/// Arrays with a row of three values for each corner or triangle; colors are 0 to 255.
struct ColoredMesh {
  std::vector<float> positions;
  std::vector<float> normals;
  std::vector<std::uint8_t> colors;
  std::vector<std::uint32_t> triangles;
  bool has_colors = false;
  std::string error;
};

std::array<std::uint8_t, 3> colorOf(const aiMaterial& material, bool* is_given) {
  aiColor3D color(0.7F, 0.7F, 0.7F);
  if (material.Get(AI_MATKEY_COLOR_DIFFUSE, color) == AI_SUCCESS) *is_given = true;
  const auto byte = [](float part) {
    return static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(part, 0.0F, 1.0F)));
  };
  return {byte(color.r), byte(color.g), byte(color.b)};
}

void addMesh(const aiMesh& mesh, const aiScene& scene, const aiMatrix4x4& pose,
             ColoredMesh& result) {
  if (!mesh.HasNormals()) return;
  const auto first = static_cast<std::uint32_t>(result.positions.size() / 3);
  const aiMatrix3x3 turn(pose);
  const std::array<std::uint8_t, 3> color =
      colorOf(*scene.mMaterials[mesh.mMaterialIndex], &result.has_colors);
  for (unsigned int i = 0; i < mesh.mNumVertices; ++i) {
    const aiVector3D place = pose * mesh.mVertices[i];
    aiVector3D normal = turn * mesh.mNormals[i];
    normal.NormalizeSafe();
    result.positions.insert(result.positions.end(), {place.x, place.y, place.z});
    result.normals.insert(result.normals.end(), {normal.x, normal.y, normal.z});
    result.colors.insert(result.colors.end(), color.begin(), color.end());
  }
  for (unsigned int i = 0; i < mesh.mNumFaces; ++i) {
    const aiFace& face = mesh.mFaces[i];
    if (face.mNumIndices != 3) continue;  // points and lines have no surface
    for (unsigned int corner = 0; corner < 3; ++corner)
      result.triangles.push_back(first + face.mIndices[corner]);
  }
}

void addNode(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent,
             ColoredMesh& result) {
  const aiMatrix4x4 pose = parent * node.mTransformation;
  for (unsigned int i = 0; i < node.mNumMeshes; ++i)
    addMesh(*scene.mMeshes[node.mMeshes[i]], scene, pose, result);
  for (unsigned int i = 0; i < node.mNumChildren; ++i)
    addNode(scene, *node.mChildren[i], pose, result);
}

void read(const std::string& path, ColoredMesh& result) {
  MeshReader reader;
  reader.importer().SetPropertyFloat(AI_CONFIG_PP_GSN_MAX_SMOOTHING_ANGLE, kSmoothUpToDegrees);
  const aiScene& scene = reader.read(
      path, aiProcess_Triangulate | aiProcess_GenSmoothNormals | aiProcess_JoinIdenticalVertices);
  addNode(scene, *scene.mRootNode, aiMatrix4x4(), result);
  if (result.triangles.empty())
    throw std::invalid_argument("the mesh " + path + " cannot be read: it has no triangles");
}

ColoredMesh* answered(const std::function<void(ColoredMesh&)>& step) {
  auto* result = new ColoredMesh;
  try {
    step(*result);
  } catch (const std::exception& error) {
    result->error = error.what();
  }
  return result;
}

}  // namespace

extern "C" {

/// Returns a mesh to be passed to colored_mesh_delete. If it has an error, it has no triangles.
ColoredMesh* colored_mesh_read(const char* path) {
  return answered([&](ColoredMesh& result) { read(path, result); });
}

/// Checks only that the mesh is safe to parse; the result has no triangles.
ColoredMesh* colored_mesh_check(const char* path) {
  return answered([&](ColoredMesh&) { checkMesh(contentOf(path), path); });
}

void colored_mesh_delete(ColoredMesh* mesh) { delete mesh; }

const char* colored_mesh_error(const ColoredMesh* mesh) { return mesh->error.c_str(); }

int colored_mesh_has_colors(const ColoredMesh* mesh) { return mesh->has_colors ? 1 : 0; }

std::size_t colored_mesh_corners(const ColoredMesh* mesh) { return mesh->positions.size() / 3; }

std::size_t colored_mesh_triangles(const ColoredMesh* mesh) { return mesh->triangles.size() / 3; }

const float* colored_mesh_positions(const ColoredMesh* mesh) { return mesh->positions.data(); }

const float* colored_mesh_normals(const ColoredMesh* mesh) { return mesh->normals.data(); }

const std::uint8_t* colored_mesh_colors(const ColoredMesh* mesh) { return mesh->colors.data(); }

const std::uint32_t* colored_mesh_indices(const ColoredMesh* mesh) {
  return mesh->triangles.data();
}
}
