// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/sender/transfer.hpp"

#include <algorithm>

namespace process_visualizer::sender {

namespace {

constexpr std::size_t kSmallBytes = 32 << 10;  // up to here, all is written when it is due
constexpr std::size_t kSliceBytes = 128 << 10;
constexpr std::int64_t kSliceNs = 500'000;  // a subscriber has taken a slice by then
constexpr std::size_t kMostSlices = 16;     // a command takes effect only after a begun message

std::size_t quotientUp(std::size_t dividend, std::size_t divisor) {
  return (dividend + divisor - 1) / divisor;
}

}  // namespace

Transfer::Transfer(std::size_t size, std::int64_t due_ns)
    : size_(size),
      due_ns_(due_ns),
      slice_bytes_(std::max(kSliceBytes, quotientUp(size, kMostSlices))) {}

std::int64_t Transfer::timeOf(std::size_t written) const {
  if (size_ <= kSmallBytes || written + 1 >= size_) return due_ns_;
  const std::size_t slices = quotientUp(size_ - 1 - written, slice_bytes_);
  return due_ns_ - static_cast<std::int64_t>(slices) * kSliceNs;
}

std::size_t Transfer::sizeOf(std::size_t written, std::int64_t now_ns) const {
  const std::size_t rest = size_ - written;
  return now_ns >= due_ns_ ? rest : std::min(rest - 1, slice_bytes_);
}

}  // namespace process_visualizer::sender
