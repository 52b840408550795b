// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/sender/packet.hpp"

#include <cstdint>
#include <cstring>

namespace process_visualizer::sender {

Packet::Packet(const char* message, std::size_t size)
    : size_(size + sizeof(std::uint32_t)), bytes_(new char[size_]) {
  for (std::size_t byte = 0; byte < sizeof(std::uint32_t); ++byte)
    bytes_[byte] = static_cast<char>(size >> (8 * byte));
  if (size > 0) std::memcpy(bytes_.get() + sizeof(std::uint32_t), message, size);
}

}  // namespace process_visualizer::sender
