// SPDX-License-Identifier: BSD-3-Clause
// Resolves package:// and file:// addresses; refuses paths outside their package.

#include "process_visualizer/mesh/mesh_address.hpp"

#include <ros/package.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <stdexcept>

namespace process_visualizer::mesh {
namespace {

namespace fs = std::filesystem;

const std::string kPackage = "package://", kFile = "file://";
constexpr std::size_t kMaxCharacters = 4096;  // of a path

bool beginsWith(const std::string& text, const std::string& beginning) {
  return text.compare(0, beginning.size(), beginning) == 0;
}

std::invalid_argument refused(const std::string& address, const std::string& reason) {
  return std::invalid_argument("the mesh " + address + " is not read: " + reason);
}

/// The text with escapes such as `%20` decoded.
std::string unquoted(const std::string& text) {
  const auto isHex = [&](std::size_t at) {
    return at < text.size() && std::isxdigit(static_cast<unsigned char>(text[at])) != 0;
  };
  std::string plain;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == '%' && isHex(at + 1) && isHex(at + 2)) {
      plain.push_back(static_cast<char>(std::stoi(text.substr(at + 1, 2), nullptr, 16)));
      at += 2;
    } else {
      plain.push_back(text[at]);
    }
  }
  return plain;
}

/// Returns whether a path is below a folder. Links may lead elsewhere: whoever installed the
/// package created them.
bool isBelow(const fs::path& path, const fs::path& folder) {
  const fs::path whole = path.lexically_normal(), above = (folder / "").lexically_normal();
  // The folder ends with a slash, so its last part is empty.
  return std::mismatch(above.begin(), std::prev(above.end()), whole.begin(), whole.end()).first ==
         std::prev(above.end());
}

std::string inPackage(const std::string& address) {
  const std::string rest = address.substr(kPackage.size());
  const std::string package = rest.substr(0, rest.find('/'));
  const auto isOfName = [](unsigned char it) {
    return std::isalnum(it) != 0 || it == '_' || it == '-';
  };
  const bool is_name = !package.empty() && std::all_of(package.begin(), package.end(), isOfName);
  const std::string folder = is_name ? ros::package::getPath(package) : "";
  if (folder.empty()) throw refused(address, "there is no package \"" + package + "\"");
  const fs::path path =
      fs::path(folder) / fs::path(unquoted(rest.substr(package.size()))).relative_path();
  if (!isBelow(path, folder)) throw refused(address, "it is not in its package");
  return path.string();
}

}  // namespace

Bytes contentAt(const std::string& address) {
  if (address.size() > kMaxCharacters)
    throw refused(address.substr(0, 100) + "…",
                  "it has more than " + std::to_string(kMaxCharacters) + " characters");
  if (beginsWith(address, kPackage)) return contentOf(inPackage(address));
  if (beginsWith(address, kFile + "/")) return contentOf(unquoted(address.substr(kFile.size())));
  throw refused(address, "its address begins neither with package:// nor with file:///");
}

}  // namespace process_visualizer::mesh
