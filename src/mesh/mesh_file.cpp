// SPDX-License-Identifier: BSD-3-Clause
// Limits for mesh files: size, format, and nested nodes of Collada scenes.

#include "process_visualizer/mesh/mesh_file.hpp"

#include <assimp/MemoryIOWrapper.h>
#include <assimp/config.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <assimp/IOSystem.hpp>
#include <cctype>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <map>
#include <stdexcept>

#include "process_visualizer/common/xml_walk.hpp"

namespace process_visualizer::mesh {
namespace {

constexpr std::size_t kMaxBytes = 400'000'000;  // assimp takes several times as much memory
constexpr std::size_t kMaxNodes = 100'000;      // each counted as often as it is instantiated
constexpr std::size_t kMaxHeight = 1000;        // of nested instances
const std::array<std::string, 3> kFormats = {"stl", "dae", "obj"};

std::invalid_argument unreadable(const std::string& name, const std::string& reason) {
  return std::invalid_argument("the mesh " + name + " cannot be read: " + reason);
}

/// A file open for reading.
class OpenFile {
 public:
  explicit OpenFile(const std::string& path)
      : number_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {}
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() {
    if (number_ >= 0) ::close(number_);
  }
  int number() const { return number_; }

 private:
  int number_;
};

void checkStatus(const std::string& path, int result, const struct stat& status) {
  if (result != 0) throw unreadable(path, std::strerror(errno));
  if (!S_ISREG(status.st_mode)) throw std::invalid_argument("the mesh " + path + " is not a file");
  if (static_cast<std::size_t>(status.st_size) > kMaxBytes)
    throw std::invalid_argument("the mesh " + path + " has " +
                                std::to_string(status.st_size / 1'000'000) + " MB; it is left out");
}

/// The extension in lower case.
std::string formatOf(const std::string& name) {
  std::string format = name.substr(name.rfind('.') + 1);
  std::transform(format.begin(), format.end(), format.begin(),
                 [](unsigned char it) { return std::tolower(it); });
  return format;
}

}  // namespace

Bytes contentOf(const std::string& path) {
  if (path.find('\0') != std::string::npos) throw unreadable(path.c_str(), "its name has a zero");
  struct stat status {};
  checkStatus(path, ::stat(path.c_str(), &status), status);  // opening a device has effects
  const OpenFile file(path);
  checkStatus(path, file.number() < 0 ? -1 : ::fstat(file.number(), &status), status);
  Bytes content(static_cast<std::size_t>(status.st_size));
  std::size_t taken = 0;
  while (taken < content.size()) {
    const ssize_t got = ::read(file.number(), content.data() + taken, content.size() - taken);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw unreadable(path, std::strerror(errno));
    if (got == 0) break;  // it has become shorter
    taken += static_cast<std::size_t>(got);
  }
  content.resize(taken);
  return content;
}

namespace {

/// The nodes of a Collada file and their instances.
class ColladaScene {
 public:
  void begin(const std::string& tag, XmlAttributes attributes) {
    const std::string kind = localName(tag);
    if (kind == "instance_node") {
      const std::string url = attribute(attributes, "url");
      nodes_[open_.back()].shown.push_back(
          url.substr(std::min(url.find_first_not_of('#'), url.size())));
    } else if (kind == "node") {
      const std::size_t number = nodes_.size();
      if (number > kMaxNodes) throw tooMany();
      nodes_.emplace_back();
      nodes_[open_.back()].inside.push_back(number);
      numbers_.emplace(attribute(attributes, "id"), number);
      open_.push_back(number);
    }
  }

  void end(const std::string& tag) {
    if (localName(tag) == "node") open_.pop_back();
  }

  void check() { measure(0, 0); }

 private:
  struct Node {
    std::vector<std::size_t> inside;
    std::vector<std::string> shown;  ///< ids
    bool is_measured = false;
    std::size_t count = kMaxNodes + 1;  ///< of nodes that it shows, including itself
    std::size_t height = 0;             ///< of nested instances
  };

  static std::string localName(const std::string& tag) { return tag.substr(tag.rfind(':') + 1); }

  static std::string attribute(XmlAttributes attributes, const std::string& name) {
    for (; *attributes != nullptr; attributes += 2)
      if (name == attributes[0]) return attributes[1];
    return "";
  }

  static std::invalid_argument tooMany() {
    return std::invalid_argument("it shows more than " + std::to_string(kMaxNodes) + " nodes");
  }

  const Node& measure(std::size_t number, std::size_t depth) {
    if (depth > kMaxHeight)
      throw std::invalid_argument("more than " + std::to_string(kMaxHeight) +
                                  " of its nodes show one another");
    Node& node = nodes_[number];
    if (node.is_measured) return node;  // one that contains itself counts as too many
    node.is_measured = true;
    std::size_t count = 1, height = 0;
    const auto add = [&](std::size_t inside) {
      const Node& shown = measure(inside, depth + 1);
      count += shown.count;
      height = std::max(height, shown.height + 1);
      if (count > kMaxNodes) throw tooMany();
      if (depth + height > kMaxHeight)
        throw std::invalid_argument("more than " + std::to_string(kMaxHeight) +
                                    " of its nodes show one another");
    };
    for (const std::size_t inside : node.inside) add(inside);
    for (const std::string& id : node.shown) {
      const auto found = numbers_.find(id);
      if (found != numbers_.end()) add(found->second);
    }
    node.count = count;
    node.height = height;
    return node;
  }

  std::vector<Node> nodes_{1};  ///< the first one stands for the whole file
  std::map<std::string, std::size_t> numbers_;
  std::vector<std::size_t> open_{0};
};

void checkCollada(const Bytes& content) {
  ColladaScene scene;
  walkXml(
      reinterpret_cast<const char*>(content.data()), content.size(),
      [&](const std::string& tag, XmlAttributes attributes) { scene.begin(tag, attributes); },
      [&](const std::string& tag) { scene.end(tag); });
  scene.check();
}

}  // namespace

void checkMesh(const Bytes& content, const std::string& name) {
  const std::string format = formatOf(name);
  // assimp has parsers for many other formats; in some, a few bytes cause it to allocate all
  // memory.
  if (std::find(kFormats.begin(), kFormats.end(), format) == kFormats.end())
    throw unreadable(name, "only STL, Collada (.dae) and OBJ are");
  if (format != "dae") return;
  try {
    checkCollada(content);
  } catch (const std::invalid_argument& error) {
    throw unreadable(name, error.what());
  }
}

namespace {

/// Files for assimp, with a limited total size.
class RegularFiles : public Assimp::IOSystem {
 public:
  bool Exists(const char* path) const override {
    struct stat status {};
    return ::stat(path, &status) == 0 && S_ISREG(status.st_mode);
  }

  char getOsSeparator() const override { return '/'; }

  Assimp::IOStream* Open(const char* path, const char* mode) override {
    if (*mode != 'r') return nullptr;
    try {
      const Bytes content = contentOf(path);
      if (content.size() > left_) return nullptr;
      left_ -= content.size();
      auto* bytes = new std::uint8_t[content.size()];
      std::copy(content.begin(), content.end(), bytes);
      return new Assimp::MemoryIOStream(bytes, content.size(), /*own=*/true);
    } catch (const std::invalid_argument&) {
      return nullptr;  // assimp reports the missing file, or does without it
    }
  }

  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  std::size_t left_ = 2 * kMaxBytes;  // assimp opens a file to look at it, and again to read it
};

}  // namespace

MeshReader::MeshReader() {
  importer_.SetIOHandler(new RegularFiles);  // owned by the importer
  // As in RViz: the unit of a Collada file counts, its up axis does not.
  importer_.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
}

const aiScene& MeshReader::read(const std::string& path, unsigned int steps) {
  checkMesh(contentOf(path), path);
  return checked(importer_.ReadFile(path, steps), path);
}

const aiScene& MeshReader::read(const Bytes& content, const std::string& name, unsigned int steps) {
  checkMesh(content, name);
  return checked(
      importer_.ReadFileFromMemory(content.data(), content.size(), steps, formatOf(name).c_str()),
      name);
}

const aiScene& MeshReader::checked(const aiScene* scene, const std::string& name) const {
  if (scene == nullptr || scene->mRootNode == nullptr)
    throw unreadable(name, importer_.GetErrorString());
  return *scene;
}

}  // namespace process_visualizer::mesh
