// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace process_visualizer::recorder {

/// What has gone wrong: the newest texts, and how many there were since the node runs.
class Problems {
 public:
  static constexpr std::size_t kMost = 20;  ///< that are remembered

  void add(const std::string& text) {
    texts_.push_back(text);
    ++count_;
    if (texts_.size() > kMost) texts_.erase(texts_.begin());
  }
  void clear() { texts_.clear(); }  ///< forgets the texts; the count goes on
  const std::vector<std::string>& texts() const { return texts_; }  ///< the newest last
  std::uint32_t count() const { return count_; }

 private:
  std::vector<std::string> texts_;
  std::uint32_t count_ = 0;
};

}  // namespace process_visualizer::recorder
