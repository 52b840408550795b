// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>

namespace process_visualizer::sender {

/// A message in the format of TCPROS: its length (uint32, little-endian), then its bytes.
class Packet {
 public:
  Packet() = default;  ///< no message: ends the latching of a topic's source
  Packet(const char* message, std::size_t size);

  bool hasMessage() const { return size_ > 0; }

  const char* data() const { return bytes_.get(); }
  std::size_t size() const { return size_; }  ///< with the length before the message

 private:
  std::size_t size_ = 0;
  std::unique_ptr<char[]> bytes_;
};

/// One copy for all subscribers of a topic.
using PacketPtr = std::shared_ptr<const Packet>;

}  // namespace process_visualizer::sender
