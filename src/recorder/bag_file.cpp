// SPDX-License-Identifier: BSD-3-Clause
// Bag format 2.0 on disk: records, reserved space, names of bags, and errors of the file system.

#include "process_visualizer/recorder/bag_file.hpp"

#include <fcntl.h>
#include <roslz4/lz4s.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>

#include "process_visualizer/recorder/problems.hpp"

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

/// The path with a number, for a bag beside another one of that name.
std::string numbered(const std::string& path, unsigned number) {
  return path.substr(0, path.size() - 4) + "-" + std::to_string(number) + kExtension;
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
    throw RecordingError("enter a full path (starting with /) instead of the folder \"" + folder +
                         "\"");
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
    throw RecordingError(folder + ": less than " + std::to_string((bytes + (1 << 20) - 1) >> 20) +
                         " MiB are free; make room or choose another folder");
  return space.available;
}

namespace {

constexpr char kMagic[] = "#ROSBAG V2.0\n";
// Size of the file's first record, without its two lengths. rosbag's tools rewrite it in this size:
// if it were smaller here, they would overwrite the beginning of the first chunk.
constexpr std::size_t kBagHeaderBytes = 4096;
constexpr std::size_t kChunkBytes = 1 << 20;
constexpr std::uint64_t kWriteBackBytes = 8 << 20;
// Reserved behind every chunk, for the account at the end of a recording.
constexpr std::uint64_t kSpareBytes = 128 << 10;
constexpr int kLz4BlockSize = 6;  // as in rosbag

enum Operation : char {
  kMessage = 2,
  kBagHeader = 3,
  kIndex = 4,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7,
};

using Fields = std::vector<std::pair<std::string, std::string>>;

// Numbers in a bag are little-endian, as on all machines that run ROS 1.
template <typename Number>
std::string packed(Number number) {
  return {reinterpret_cast<const char*>(&number), sizeof number};
}

std::string packed(const ros::Time& time) { return packed(time.sec) + packed(time.nsec); }

std::string packedHeader(const Fields& fields) {
  std::string header;
  for (const auto& [name, value] : fields)
    header +=
        packed(static_cast<std::uint32_t>(name.size() + 1 + value.size())) + name + "=" + value;
  return header;
}

void append(std::string& to, const Fields& fields, const char* data, std::size_t size) {
  const std::string header = packedHeader(fields);
  to += packed(static_cast<std::uint32_t>(header.size()));
  to += header;
  to += packed(static_cast<std::uint32_t>(size));
  to.append(data, size);
}

std::string record(const Fields& fields, const std::string& data) {
  std::string bytes;
  append(bytes, fields, data.data(), data.size());
  return bytes;
}

std::string bagHeader(std::uint64_t index, std::size_t connections, std::uint32_t chunks) {
  const Fields fields = {{"op", {kBagHeader}},
                         {"index_pos", packed(index)},
                         {"conn_count", packed(static_cast<std::uint32_t>(connections))},
                         {"chunk_count", packed(chunks)}};
  return kMagic + record(fields, std::string(kBagHeaderBytes - packedHeader(fields).size(), ' '));
}

std::string compressed(const std::string& data, const std::string& path) {
  std::string source = data;  // the library's function is not const-correct
  // maximum size after compression
  std::string result(data.size() + data.size() / 255 + 1024, '\0');
  unsigned size = result.size();
  if (roslz4_buffToBuffCompress(source.data(), source.size(), result.data(), &size,
                                kLz4BlockSize) != ROSLZ4_OK)
    throw RecordingError(path + ": lz4 cannot compress a chunk; record without compression");
  result.resize(size);
  return result;
}

}  // namespace

BagFile::BagFile(std::string path, Compression compression)
    : path_(std::move(path)),
      compression_(compression),
      descriptor_(open(activePath().c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666)) {
  if (descriptor_ < 0) fail("cannot be created");
  const std::string header = bagHeader(0, 0, 0);
  try {
    reserve(header.size());
    writeAt(0, header);
  } catch (const RecordingError&) {
    ::close(descriptor_);
    unlink(activePath().c_str());
    throw;
  }
  position_ = header.size();
}

BagFile::~BagFile() { ::close(descriptor_); }

void BagFile::write(const Message& message) {
  if (chunk_.size() >= kChunkBytes) flush();
  const std::uint32_t id = connectionId(message.connection);
  entries_[id].push_back({message.time, static_cast<std::uint32_t>(chunk_.size())});
  append(chunk_, {{"op", {kMessage}}, {"conn", packed(id)}, {"time", packed(message.time)}},
         reinterpret_cast<const char*>(message.content->bytes.data()), message.size());
  ++counts_[message.topic()];
}

std::uint32_t BagFile::connectionId(const ConnectionPtr& connection) {
  const auto [place, is_new] = ids_.try_emplace(connection, ids_.size());
  if (is_new) {
    const Fields header(connection->header.begin(), connection->header.end());
    connection_records_.push_back(record(
        {{"op", {kConnection}}, {"conn", packed(place->second)}, {"topic", connection->topic}},
        packedHeader(header)));
    chunk_ += connection_records_.back();
    connection_bytes_ += connection_records_.back().size();
  }
  return place->second;
}

void BagFile::flush() { writeChunk(kSpareBytes); }

void BagFile::writeChunk(std::uint64_t spare_bytes) {
  if (chunk_.empty()) return;
  const std::string info = chunkInfo();
  try {
    const bool is_lz4 = compression_ == Compression::kLz4;
    const std::string smaller = is_lz4 ? compressed(chunk_, path_) : std::string();
    const std::string& data = is_lz4 ? smaller : chunk_;
    const std::string head = chunkHead(data.size());
    const std::string index = chunkIndex();
    const std::uint64_t size = head.size() + data.size() + index.size();
    reserve(size + connection_bytes_ + chunk_infos_.size() + info.size() + spare_bytes);
    writeAt(position_, head);
    writeAt(position_ + head.size(), data);
    writeAt(position_ + head.size() + data.size(), index);
    position_ += size;
  } catch (const RecordingError&) {
    discard();
    throw;
  }
  chunk_infos_ += info;
  ++chunk_count_;
  chunk_.clear();
  entries_.clear();
  if (position_ - flushed_ >= kWriteBackBytes) {
    // Writing back steadily keeps the writer from waiting for all of it at once.
    sync_file_range(descriptor_, flushed_, position_ - flushed_, SYNC_FILE_RANGE_WRITE);
    flushed_ = position_;
  }
}

/// Returns the bytes of the chunk's record before its data: the header, and the size of the data.
std::string BagFile::chunkHead(std::size_t data_bytes) const {
  const std::string header =
      packedHeader({{"op", {kChunk}},
                    {"compression", compression_ == Compression::kLz4 ? "lz4" : "none"},
                    {"size", packed(static_cast<std::uint32_t>(chunk_.size()))}});
  return packed(static_cast<std::uint32_t>(header.size())) + header +
         packed(static_cast<std::uint32_t>(data_bytes));
}

std::string BagFile::chunkIndex() const {
  std::string index;
  for (const auto& [id, entries] : entries_) {
    std::string data;
    for (const Entry& entry : entries) data += packed(entry.time) + packed(entry.offset);
    index += record({{"op", {kIndex}},
                     {"ver", packed(std::uint32_t{1})},
                     {"conn", packed(id)},
                     {"count", packed(static_cast<std::uint32_t>(entries.size()))}},
                    data);
  }
  return index;
}

std::string BagFile::chunkInfo() const {
  std::string counts;
  ros::Time begin = ros::TIME_MAX, end = ros::TIME_MIN;
  for (const auto& [id, entries] : entries_) {
    counts += packed(id) + packed(static_cast<std::uint32_t>(entries.size()));
    for (const Entry& entry : entries) {
      begin = std::min(begin, entry.time);
      end = std::max(end, entry.time);
    }
  }
  return record({{"op", {kChunkInfo}},
                 {"ver", packed(std::uint32_t{1})},
                 {"chunk_pos", packed(position_)},
                 {"start_time", packed(begin)},
                 {"end_time", packed(end)},
                 {"count", packed(static_cast<std::uint32_t>(entries_.size()))}},
                counts);
}

std::string BagFile::finish(PowerCut power_cut) {
  std::string problem;
  try {
    writeChunk(0);
  } catch (const RecordingError& error) {
    problem = error.what();  // the earlier chunks still become a bag
  }
  std::string index;
  for (const std::string& connection : connection_records_) index += connection;
  index += chunk_infos_;
  writeAt(position_, index);
  if (ftruncate(descriptor_, position_ + index.size()) != 0) fail("cannot be finished");
  writeAt(0, bagHeader(position_, connection_records_.size(), chunk_count_));
  if (isRemoved()) rescue();
  rename();
  // From here on the bag is complete for every program.
  if (power_cut == PowerCut::kCostsNothing && fsync(descriptor_) != 0)
    fail("cannot be written to the disk");
  return problem;
}

void BagFile::remove() { unlink((is_named_ ? path_ : activePath()).c_str()); }

/// Reserves space for the next bytes, if the file system can.
void BagFile::reserve(std::uint64_t bytes) {
  rlimit largest{};  // not checked by fallocate
  if (getrlimit(RLIMIT_FSIZE, &largest) == 0 && position_ + bytes > largest.rlim_cur) {
    errno = EFBIG;
    fail("cannot be written");
  }
  while (fallocate(descriptor_, FALLOC_FL_KEEP_SIZE, position_, bytes) != 0) {
    if (errno == EOPNOTSUPP || errno == ENOSYS) return;
    if (errno != EINTR) fail("cannot be written");
  }
}

void BagFile::discard() {
  for (const auto& [connection, id] : ids_) {
    const auto entries = entries_.find(id);
    if (entries == entries_.end()) continue;
    discarded_[connection->topic] += entries->second.size();
    counts_[connection->topic] -= entries->second.size();
  }
  chunk_.clear();
  entries_.clear();
  // If no space could be reserved, a part of the chunk may have been written.
  if (ftruncate(descriptor_, position_) != 0) fail("cannot be cut to its whole chunks");
}

void BagFile::writeAt(std::uint64_t position, const std::string& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count =
        pwrite(descriptor_, bytes.data() + done, bytes.size() - done, position + done);
    if (count < 0 && errno != EINTR) fail("cannot be written");
    done += std::max<ssize_t>(count, 0);
  }
}

bool BagFile::isRemoved() const {
  struct stat here {};
  struct stat there {};
  return fstat(descriptor_, &here) != 0 || stat(activePath().c_str(), &there) != 0 ||
         here.st_ino != there.st_ino || here.st_dev != there.st_dev;
}

std::uint64_t BagFile::freeBytes() const {
  struct statvfs disk {};
  if (fstatvfs(descriptor_, &disk) != 0) fail("is on a disk that does not answer");
  return static_cast<std::uint64_t>(disk.f_bavail) * disk.f_frsize;
}

/// Copies the removed file, which exists while it is open, to its former path, or to a numbered
/// one.
void BagFile::rescue() {
  createFolder(std::filesystem::path(path_).parent_path());
  const auto create = [this] {
    return open(activePath().c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  };
  const std::string wanted = path_;
  int copy = create();
  for (unsigned i = 2; copy < 0; ++i) {
    if (errno != EEXIST)
      fail("was removed while it was being written, and cannot be created again");
    path_ = numbered(wanted, i);
    copy = create();
  }
  const int original = descriptor_;
  descriptor_ = copy;
  std::string buffer(kChunkBytes, '\0');
  std::uint64_t position = 0;
  ssize_t count;
  while ((count = pread(original, buffer.data(), buffer.size(), position)) > 0) {
    writeAt(position, buffer.substr(0, count));
    position += count;
  }
  ::close(original);
  if (count < 0) fail("was removed while it was being written, and can no longer be read");
}

void BagFile::rename() {
  const std::string wanted = path_;
  const std::string active = activePath();
  for (unsigned i = 2; link(active.c_str(), path_.c_str()) != 0; ++i) {
    if (errno == EPERM || errno == EOPNOTSUPP || errno == ENOSYS) {  // no hard links
      if (access(path_.c_str(), F_OK) != 0) {
        if (std::rename(active.c_str(), path_.c_str()) != 0) fail("cannot be renamed");
        is_named_ = true;
        return;
      }
    } else if (errno != EEXIST) {
      fail("cannot be renamed");
    }
    path_ = numbered(wanted, i);
  }
  is_named_ = true;
  unlink(active.c_str());
}

void BagFile::fail(const std::string& what) const {
  const int number = errno;
  const bool is_full = number == ENOSPC || number == EDQUOT || number == EFBIG;
  throw RecordingError(path_ + " " + what + ": " + std::strerror(number) +
                       (is_full ? "; make room or choose another folder"
                                : "; check the folder and its permissions"));
}

}  // namespace process_visualizer::recorder
