// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace process_visualizer {

/// Compares the lengths that a message of one type claims with the bytes that are there.
///
/// What ROS generates to read a message makes room for an array of the claimed length first, and
/// then looks whether the bytes are there: twelve bytes can take all memory.
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
