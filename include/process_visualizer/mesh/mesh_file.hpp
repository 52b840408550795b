// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Untrusted mesh files: which ones are safe to parse, and reading them with assimp.

#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cstdint>
#include <string>
#include <vector>

namespace process_visualizer::mesh {

using Bytes = std::vector<std::uint8_t>;

/// Returns the content of a file.
/// \throws std::invalid_argument that names the file, if it is a pipe (reading would block forever)
///   or a device (reading would never end), if it is too large for a mesh, or if it cannot be read
Bytes contentOf(const std::string& path);

/// Checks that a mesh is safe to parse: it must be STL, OBJ, or Collada with a scene of acceptable
/// size. A few kB can instantiate a node again and again within others.
/// \param name  with the extension of its format
/// \throws std::invalid_argument that names the mesh and says why not
void checkMesh(const Bytes& content, const std::string& name);

/// Reads untrusted meshes with assimp, as RViz does.
///
/// All that assimp opens, including files named by a mesh, is a file of limited size, as for
/// `contentOf`. A returned scene is valid until the next read, and as long as the reader. All
/// functions throw std::invalid_argument that names the mesh and says what is wrong.
class MeshReader {
 public:
  MeshReader();
  /// \param steps  assimp's aiPostProcessSteps
  const aiScene& read(const std::string& path, unsigned int steps);
  const aiScene& read(const Bytes& content, const std::string& name, unsigned int steps);
  /// Access to assimp's own settings.
  Assimp::Importer& importer() { return importer_; }

 private:
  const aiScene& checked(const aiScene* scene, const std::string& name) const;

  Assimp::Importer importer_;
};

}  // namespace process_visualizer::mesh
