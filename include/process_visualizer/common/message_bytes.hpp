// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace process_visualizer {

/// Reads a message's bytes from front to back (ROS 1's serialization, on a little-endian machine).
///
/// A message may claim any length: it is compared with the bytes that are there before anything
/// is allocated. All functions throw std::invalid_argument where the bytes end too early.
class WireReader {
 public:
  WireReader(const std::uint8_t* bytes, std::size_t size) : data_(bytes), left_(size) {}
  explicit WireReader(const std::vector<std::uint8_t>& bytes)
      : WireReader(bytes.data(), bytes.size()) {}

  std::size_t left() const { return left_; }  ///< bytes that have not been read
  void skip(std::size_t bytes) { take(bytes); }

  template <typename Number>
  Number number() {
    Number value;
    std::memcpy(&value, take(sizeof value), sizeof value);
    return value;
  }

  std::string text() {
    const std::size_t length = count(1);
    return {reinterpret_cast<const char*>(take(length)), length};
  }

  std::vector<std::string> texts() {
    const std::size_t size = count(sizeof(std::uint32_t));
    std::vector<std::string> found;
    found.reserve(size);
    for (std::size_t i = 0; i < size; ++i) found.push_back(text());
    return found;
  }

  template <typename Number>
  std::vector<Number> numbers() {
    std::vector<Number> found(count(sizeof(Number)));
    const std::size_t bytes = found.size() * sizeof(Number);
    if (bytes > 0) std::memcpy(found.data(), take(bytes), bytes);
    return found;
  }

  /// Returns the length before an array of elements that take at least so many bytes each.
  std::size_t count(std::size_t least_bytes) {
    const std::size_t claimed = number<std::uint32_t>();
    if (claimed > left_ / least_bytes)
      throw std::invalid_argument("it claims " + std::to_string(claimed) + " elements, and only " +
                                  std::to_string(left_) + " bytes follow");
    return claimed;
  }

  /// Throws if there are bytes behind the message.
  void end() const {
    if (left_ > 0)
      throw std::invalid_argument(std::to_string(left_) + " bytes follow its last field");
  }

 private:
  const std::uint8_t* take(std::size_t bytes) {
    if (bytes > left_) throw std::invalid_argument("its bytes end too early");
    const std::uint8_t* taken = data_;
    data_ += bytes;
    left_ -= bytes;
    return taken;
  }

  const std::uint8_t* data_;
  std::size_t left_;
};

/// Compares the lengths that a message of one type claims with the bytes that are there.
///
/// The readers that ROS generates make room for an array of the claimed length first, and then look
/// whether the bytes are there: twelve bytes can take all memory.
class ClaimedLengths {
 public:
  /// Takes a type such as sensor_msgs/Image and its definition as genmsg writes it, with those of
  /// the types in it. Throws std::invalid_argument if that cannot be understood.
  ClaimedLengths(const std::string& type, const std::string& definition);

  /// Throws std::invalid_argument if the bytes end before everything that they claim.
  void check(const std::uint8_t* bytes, std::size_t size) const;

 private:
  struct Field {
    std::string type;
    bool is_array = false;
    std::optional<std::size_t> length;  ///< of an array; otherwise the message says it
  };

  class Walk;

  void read(const std::string& type, const std::string& definition);
  void measure(const std::string& type, int depth);

  std::string type_;
  std::map<std::string, std::vector<Field>> fields_;  ///< of each message in the definition
  std::map<std::string, std::size_t> least_bytes_;    ///< that one of a type takes
  std::map<std::string, bool> is_fixed_;              ///< whether it always takes these
};

}  // namespace process_visualizer
