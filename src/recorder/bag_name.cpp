// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/recorder/bag_name.hpp"

#include <algorithm>
#include <cctype>
#include <ctime>
#include <filesystem>

#include "process_visualizer/recorder/bag_file.hpp"

namespace process_visualizer::recorder {
namespace {

constexpr const char* kExtension = ".bag";

std::string stemOf(const std::string& path) {
  const std::string extension = kExtension;
  const bool has_extension =
      path.size() > extension.size() &&
      path.compare(path.size() - extension.size(), std::string::npos, extension) == 0;
  return has_extension ? path.substr(0, path.size() - extension.size()) : path;
}

void checkPrintable(const std::string& name) {
  const auto is_control = [](unsigned char c) { return std::iscntrl(c) != 0; };
  if (std::any_of(name.begin(), name.end(), is_control))
    throw RecordingError("the name \"" + name + "\" has a character that cannot be printed");
}

void checkName(const std::string& name) {
  if (name.find('/') != std::string::npos)
    throw RecordingError("the name \"" + name +
                         "\" must not contain a slash: the folder is chosen separately");
  checkPrintable(name);
  if (stemOf(name).empty() || name[0] == '.')
    throw RecordingError("the name \"" + name + "\" must not start with a dot");
}

bool isTaken(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const std::string first = partPath(path, 0);
  for (const std::string& it : {path, path + ".active", first, first + ".active"})
    if (fs::exists(fs::symlink_status(it, ignored))) return true;
  return false;
}

std::string dateAndTime() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d-%H-%M-%S", &local);
  return text;
}

/// Rounded up.
std::uint64_t inMegabytes(std::uint64_t bytes) {
  return (bytes >> 20) + static_cast<std::uint64_t>(bytes % (1 << 20) != 0);
}

}  // namespace

std::string newBagPath(const std::string& folder, const std::string& prefix,
                       const std::string& name) {
  if (!name.empty()) {
    checkName(name);
    std::string path = folder + "/" + stemOf(name) + kExtension;
    if (isTaken(path))
      throw RecordingError(path + " exists already and is not overwritten; choose another name");
    return path;
  }
  if (!prefix.empty()) checkName(prefix);
  const std::string stem = folder + "/" + (prefix.empty() ? "" : prefix + "_") + dateAndTime();
  std::string path = stem + kExtension;
  for (unsigned i = 2; isTaken(path); ++i) path = stem + "-" + std::to_string(i) + kExtension;
  return path;
}

std::string partPath(const std::string& path, unsigned part) {
  return stemOf(path) + "_" + std::to_string(part) + kExtension;
}

void createFolder(const std::string& folder) {
  checkPrintable(folder);
  if (folder.empty() || folder[0] != '/')
    throw RecordingError("the folder \"" + folder +
                         "\" has to be written as a whole path, beginning with /");
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw RecordingError(folder + ": the folder cannot be created: " + error.message() +
                         "; choose another");
}

std::uint64_t requireRoom(const std::string& folder, std::uint64_t bytes) {
  std::error_code error;
  const auto space = std::filesystem::space(folder, error);
  if (error) throw RecordingError(folder + ": " + error.message() + "; choose another folder");
  if (space.available < bytes)
    throw RecordingError(folder + ": less than " + std::to_string(inMegabytes(bytes)) +
                         " MB are free; make room or choose another folder");
  return space.available;
}

}  // namespace process_visualizer::recorder
