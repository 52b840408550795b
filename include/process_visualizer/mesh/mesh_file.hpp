// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cstdint>
#include <string>
#include <vector>

namespace process_visualizer::mesh {

using Bytes = std::vector<std::uint8_t>;

/// Returns what is in a file.
/// \throws std::invalid_argument that names it, if it is no file but a pipe, at which a reader
///   waits for ever, or a device, which it reads without end; if it is too large for a mesh; or if
///   it cannot be read
Bytes contentOf(const std::string& path);

/// Looks whether a mesh can be given to a reader: it must be STL, OBJ, or Collada, whose scene is
/// of a size that readers bear. A few kB can show one node again and again within others.
/// \param name  with the extension that says the format
/// \throws std::invalid_argument that names it and says why not
void checkMesh(const Bytes& content, const std::string& name);

/// Reads meshes that somebody else wrote, with assimp, as RViz does.
///
/// All that assimp opens, also what a mesh names in turn, is a file of a limited size, as for
/// `contentOf`. What is returned lives as long as the reader, or until it reads once more.
/// All functions throw std::invalid_argument that names the mesh and says what is wrong.
class MeshReader {
 public:
  MeshReader();
  /// \param steps  assimp's aiPostProcessSteps
  const aiScene& read(const std::string& path, unsigned int steps);
  const aiScene& read(const Bytes& content, const std::string& name, unsigned int steps);
  /// For assimp's own settings.
  Assimp::Importer& importer() { return importer_; }

 private:
  const aiScene& checked(const aiScene* scene, const std::string& name) const;

  Assimp::Importer importer_;
};

}  // namespace process_visualizer::mesh
