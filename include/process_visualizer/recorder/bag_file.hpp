// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Writes one bag file: its name, chunks, index and disk space, and the rescue of a removed file.

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "process_visualizer/recorder/message.hpp"
#include "process_visualizer/recorder/problems.hpp"

namespace process_visualizer::recorder {

/// Returns the path of a new bag: FOLDER/NAME.bag or, with an empty name, FOLDER/PREFIX_DATE.bag or
/// FOLDER/DATE.bag, with the local date and time, and a number if there is such a bag already.
/// \throws RecordingError if this cannot be the name of a file, or there is such a bag already
std::string newBagPath(const std::string& folder, const std::string& prefix,
                       const std::string& name);

/// Returns the path of a part of a split recording: a.bag becomes a_0.bag, a_1.bag, ...
std::string partPath(const std::string& path, unsigned part);

/// Creates a folder and its parents. \throws RecordingError
void createFolder(const std::string& folder);

/// Returns the free bytes on a folder's disk. \throws RecordingError if there are too few
std::uint64_t requireRoom(const std::string& folder, std::uint64_t bytes);

enum class Compression { kNone, kLz4 };

/// Loss by a power cut right after a bag is finished. If it must cost nothing, `finish` waits for
/// the disk.
enum class PowerCut { kCostsNothing, kMayCostAll };

/// A bag of format 2.0 while it is being written. It is named PATH.active until it is finished.
///
/// Messages are collected into chunks, and each chunk is written together with its index. Before
/// that, space for it and for the index at the end of the file is reserved: if the disk is full,
/// only the chunk is discarded, and the bag is complete without it.
class BagFile {
 public:
  /// Creates the file. \throws RecordingError if that fails, or if there is such a file already
  BagFile(std::string path, Compression compression);
  ~BagFile();
  BagFile(const BagFile&) = delete;
  BagFile& operator=(const BagFile&) = delete;

  /// Adds a message; if the current chunk is large enough, writes that first.
  /// \throws RecordingError; then the message was not added
  void write(const Message& message);

  /// Writes the current chunk. \throws RecordingError; then the chunk is discarded
  void flush();

  /// Writes the index and gives the file its final name, or a numbered one if that is taken by now.
  /// If the file has been removed meanwhile, it is written again.
  /// \returns why the last messages could not be written; empty if they were
  /// \throws RecordingError if the bag cannot be finished
  std::string finish(PowerCut power_cut = PowerCut::kCostsNothing);

  void remove();  ///< removes the file, under its current name

  const std::string& path() const { return path_; }                 ///< the final one
  std::uint64_t size() const { return position_ + chunk_.size(); }  ///< approximately, in bytes
  /// Number of messages in it by topic, as counted by rosbag.
  const std::map<std::string, std::uint64_t>& counts() const { return counts_; }
  /// Number of messages that were added and could not be written, by topic.
  const std::map<std::string, std::uint64_t>& discarded() const { return discarded_; }
  bool isRemoved() const;           ///< true if the file has been removed or moved
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
  bool is_named_ = false;                                ///< true once it has its final name
  std::uint64_t position_ = 0;                           ///< end of the written part
  std::uint64_t flushed_ = 0;                            ///< end of the part handed to the disk
  std::string chunk_;                                    ///< uncompressed
  std::map<std::uint32_t, std::vector<Entry>> entries_;  ///< of the chunk, by connection
  std::map<ConnectionPtr, std::uint32_t> ids_;
  std::vector<std::string> connection_records_;
  std::string chunk_infos_;
  std::uint32_t chunk_count_ = 0;
  std::uint64_t connection_bytes_ = 0;
  std::map<std::string, std::uint64_t> counts_, discarded_;
};

}  // namespace process_visualizer::recorder
