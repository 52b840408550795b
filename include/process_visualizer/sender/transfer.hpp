// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

namespace process_visualizer::sender {

/// The times at which parts of a packet are written. A subscriber has a message once its last byte
/// has come: so a large one is sent in slices before it is due, and only its last byte waits. It
/// arrives on time, and small messages between the slices do not wait for it. Times are in
/// nanoseconds.
class Transfer {
 public:
  Transfer(std::size_t size, std::int64_t due_ns);

  std::int64_t due() const { return due_ns_; }
  /// When the first byte may be written.
  std::int64_t begin() const { return timeOf(0); }
  /// When the next part may be written, after some bytes have been.
  std::int64_t timeOf(std::size_t written) const;
  /// How many bytes the next part has at a time when it may be written.
  std::size_t sizeOf(std::size_t written, std::int64_t now_ns) const;

 private:
  std::size_t size_;
  std::int64_t due_ns_;
  std::size_t slice_bytes_;
};

}  // namespace process_visualizer::sender
