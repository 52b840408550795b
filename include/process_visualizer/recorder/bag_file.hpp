// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "process_visualizer/recorder/message.hpp"
#include "process_visualizer/recorder/problems.hpp"

namespace process_visualizer::recorder {

/// Returns the path of a new bag: FOLDER/NAME.bag, or with an empty name FOLDER/PREFIX_DATE.bag or
/// FOLDER/DATE.bag with the local date and time, which is numbered if there is one already.
/// \throws RecordingError if the name cannot be a file's, or there is such a bag already
std::string newBagPath(const std::string& folder, const std::string& prefix,
                       const std::string& name);

/// Returns the path of a part of a recording that is split: a.bag becomes a_0.bag, a_1.bag, ...
std::string partPath(const std::string& path, unsigned part);

/// Creates a folder with those above it. \throws RecordingError
void createFolder(const std::string& folder);

/// Returns how many bytes are free on a folder's disk. \throws RecordingError if these are too few
std::uint64_t requireRoom(const std::string& folder, std::uint64_t bytes);

enum class Compression { kNone, kLz4 };

/// Cost of a power cut right after a bag was finished: waiting for the disk takes time.
enum class PowerCut { kCostsNothing, kMayCostAll };

/// A bag of format 2.0 while it is written. It is called PATH.active until it is finished.
///
/// Messages are collected into chunks, and a chunk is written with its index at once. Before that,
/// the place for it and for the index at the end of the file is reserved: if the disk is full, the
/// chunk is discarded, and what was written before still becomes a whole bag.
class BagFile {
 public:
  /// Creates the file. \throws RecordingError if that fails, or if there is such a file already
  BagFile(std::string path, Compression compression);
  ~BagFile();
  BagFile(const BagFile&) = delete;
  BagFile& operator=(const BagFile&) = delete;

  /// Adds a message, before that writes a chunk if it is large enough.
  /// \throws RecordingError; then the message was not added
  void write(const Message& message);

  /// Writes what has been collected. \throws RecordingError; then that is discarded
  void flush();

  /// Writes the index and gives the file its name, another one if that is taken by now.
  /// If the file was removed meanwhile, it is written again.
  /// \returns why the last messages could not be written; empty if they were
  /// \throws RecordingError if the bag cannot be finished
  std::string finish(PowerCut power_cut = PowerCut::kCostsNothing);

  void remove();  ///< removes the file, by the name that it has now

  const std::string& path() const { return path_; }  ///< its name when it is finished
  std::uint64_t size() const { return position_ + chunk_.size(); }  ///< in bytes, about
  /// Number of messages in it, by topic, as rosbag counts them.
  const std::map<std::string, std::uint64_t>& counts() const { return counts_; }
  /// Messages that were added and could not be written, by topic.
  const std::map<std::string, std::uint64_t>& discarded() const { return discarded_; }
  bool isRemoved() const;           ///< whether somebody removed or moved the file
  std::uint64_t freeBytes() const;  ///< on its disk. \throws RecordingError

 private:
  struct Entry {
    ros::Time time;
    std::uint32_t offset;
  };
  std::string activePath() const { return path_ + ".active"; }
  std::uint32_t connectionId(const ConnectionPtr& connection);
  std::string chunkHead(std::size_t data_bytes) const;
  std::string chunkIndex() const;
  std::string chunkInfo() const;
  std::string fileIndex() const;
  void writeChunk(std::uint64_t spare_bytes);
  void reserve(std::uint64_t bytes);
  void discard();
  void writeAt(std::uint64_t position, const std::string& bytes);
  void rescue();
  void rename();
  [[noreturn]] void fail(const std::string& what) const;

  std::string path_;
  Compression compression_;
  int descriptor_;
  bool is_named_ = false;       ///< whether it has its name, and is active no more
  std::uint64_t position_ = 0;  ///< end of what is written
  std::uint64_t flushed_ = 0;   ///< what the kernel has been told to write to the disk
  std::string chunk_;           ///< uncompressed
  std::map<std::uint32_t, std::vector<Entry>> entries_;  ///< of the chunk, by connection
  std::map<ConnectionPtr, std::uint32_t> ids_;
  std::vector<std::string> connection_records_;
  std::string chunk_infos_;
  std::uint32_t chunk_count_ = 0;
  std::uint64_t connection_bytes_ = 0;
  std::map<std::string, std::uint64_t> counts_, discarded_;
};

}  // namespace process_visualizer::recorder
