// SPDX-License-Identifier: BSD-3-Clause
// Meshes from others, and the files that they refer to.

#include <assimp/postprocess.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "process_visualizer/mesh/mesh_address.hpp"
#include "process_visualizer/mesh/mesh_file.hpp"

namespace process_visualizer::mesh {
namespace {

namespace fs = std::filesystem;

/// A separate folder for each test.
class MeshFile : public testing::Test {
 protected:
  MeshFile() {
    std::string pattern = (fs::temp_directory_path() / "meshes_XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
  }
  ~MeshFile() override { fs::remove_all(folder_); }

  std::string file(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }

  std::string pipe(const std::string& name) const {
    const std::string path = (folder_ / name).string();
    EXPECT_EQ(::mkfifo(path.c_str(), 0600), 0);
    return path;
  }

  fs::path folder_;
};

Bytes bytesOf(const std::string& text) { return {text.begin(), text.end()}; }

template <typename Function>
std::string problemOf(const Function& function) {
  try {
    function();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}

void expectPart(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text;
}

unsigned int triangles(const std::string& path) {
  MeshReader reader;
  const aiScene& scene = reader.read(path, aiProcess_Triangulate);
  return scene.mMeshes[0]->mNumFaces;
}

std::string obj(const std::string& materials) {
  return "mtllib " + materials + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
}

TEST_F(MeshFile, IsNoPipeAndNoDevice) {
  for (const std::string& path : {pipe("a.stl"), std::string("/dev/zero"), folder_.string()})
    expectPart(problemOf([&] { contentOf(path); }), path + " is not a file");
  expectPart(problemOf([&] { contentOf((folder_ / "gone.stl").string()); }), "No such file");
  expectPart(problemOf([] { contentOf(std::string("a\0b", 3)); }), "has a zero");
}

TEST_F(MeshFile, NamesNoPipeAndNoDeviceInTurn) {
  EXPECT_EQ(triangles(file("a.obj", obj(pipe("a.mtl")))), 1U);
  EXPECT_EQ(triangles(file("b.obj", obj("a.mtl"))), 1U);
  EXPECT_EQ(triangles(file("c.obj", obj("/dev/zero"))), 1U);
  MeshReader reader;
  EXPECT_EQ(reader.read(bytesOf(obj(pipe("d.mtl"))), "d.obj", 0).mNumMeshes, 1U);
}

TEST_F(MeshFile, HasItsColors) {
  file("red.mtl", "newmtl red\nKd 1 0 0\n");
  MeshReader reader;
  const aiScene& scene = reader.read(file("a.obj", obj("red.mtl")), 0);
  aiColor3D color;
  ASSERT_EQ(scene.mMaterials[scene.mMeshes[0]->mMaterialIndex]->Get(AI_MATKEY_COLOR_DIFFUSE, color),
            AI_SUCCESS);
  EXPECT_EQ(color, aiColor3D(1, 0, 0));
}

TEST_F(MeshFile, OfOtherFormatsIsRefused) {
  // Twelve of its bytes could use up the memory.
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n";
  for (const char* name : {"a.ply", "a.xml", "a.glb", "a", "a.blend"})
    expectPart(problemOf([&] { checkMesh(bytesOf(ply), name); }), "only STL, Collada");
  EXPECT_EQ(problemOf([] { checkMesh({}, "A.STL"); }), "none");
}

std::string repeated(const std::string& text, int count) {
  std::string all;
  for (int i = 0; i < count; ++i) all += text;
  return all;
}

std::string collada(const std::string& nodes) { return "<c:COLLADA>" + nodes + "</c:COLLADA>"; }

/// Each node instantiates the next one.
std::string chain(int count, int times) {
  std::string nodes;
  for (int i = 0; i < count; ++i)
    nodes += "<node id='n" + std::to_string(i) + "'>" +
             repeated("<instance_node url='#n" + std::to_string(i + 1) + "'/>", times) + "</node>";
  return nodes;
}

TEST(Collada, IsOfASizeThatReadersBear) {
  const auto check = [](const std::string& nodes) {
    return problemOf([&] { checkMesh(bytesOf(collada(nodes)), "a.dae"); });
  };
  EXPECT_EQ(check(chain(100, 1)), "none");
  expectPart(check(chain(20, 2)), "more than 100000 nodes");
  expectPart(check("<node id='n0'><instance_node url='#n0'/></node>"), "more than 100000 nodes");
  expectPart(check(repeated("<node/>", 100'001)), "more than 100000 nodes");
  expectPart(check(chain(20'000, 1)), "more than 1000 of its nodes show one another");
  expectPart(check(repeated("<node>", 20'000)), "nested more than 200 deep");
  expectPart(check(repeated("<a>", 20'000)), "nested more than 200 deep");
  expectPart(check("<node>"), "mismatched tag in line 1");
  expectPart(problemOf([] { checkMesh(bytesOf("<!DOCTYPE a [<!ENTITY b \"c\">]><a/>"), "a.dae"); }),
             "DOCTYPE");
}

TEST_F(MeshFile, IsOnThisComputer) {
  for (const char* address : {"http://localhost/a.stl", "ftp://a/b.stl", "/etc/passwd", "a.stl", "",
                              "file://elsewhere/a.stl", "FILE:///a.stl"})
    expectPart(problemOf([&] { contentAt(address); }), "neither with package:// nor with file:///");
  EXPECT_EQ(contentAt("file://" + file("a b.stl", "x")), bytesOf("x"));
  EXPECT_EQ(contentAt("file://" + (folder_ / "a%20b.stl").string()), bytesOf("x"));
  expectPart(problemOf([&] { contentAt("file://" + pipe("p.stl")); }), "is not a file");
  expectPart(problemOf([&] { contentAt("package://" + std::string(5000, 'a')); }), "4096");
}

TEST_F(MeshFile, OfAPackageIsInIt) {
  fs::create_directories(folder_ / "meshes_here/meshes");
  file("meshes_here/package.xml", "<package format='2'><name>meshes_here</name></package>");
  file("meshes_here/meshes/a.stl", "x");
  file("b.stl", "y");
  fs::create_symlink(folder_ / "b.stl", folder_ / "meshes_here/meshes/link.stl");
  ASSERT_EQ(::setenv("ROS_PACKAGE_PATH", folder_.c_str(), 1), 0);
  EXPECT_EQ(contentAt("package://meshes_here/meshes/a.stl"), bytesOf("x"));
  EXPECT_EQ(contentAt("package://meshes_here/meshes/link.stl"), bytesOf("y"));
  for (const char* outside : {"../b.stl", "meshes/%2e%2e/../../b.stl"})
    expectPart(problemOf([&] { contentAt(std::string("package://meshes_here/") + outside); }),
               "is not in its package");
  for (const char* missing : {"package://no_such_package/a.stl", "package:///etc/passwd",
                              "package://../a.stl", "package://"})
    expectPart(problemOf([&] { contentAt(missing); }), "there is no package");
}

}  // namespace
}  // namespace process_visualizer::mesh

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
