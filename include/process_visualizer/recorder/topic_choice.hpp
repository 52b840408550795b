// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Choice of the recorded topics: names, patterns, exclusions, and the maximum number.

#include <cstddef>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "process_visualizer/recorder/publishers.hpp"

namespace process_visualizer::recorder {

/// Maximum number of topics: for each, the master and a publisher are asked, which takes some
/// milliseconds.
constexpr std::size_t kMaxTopics = 2000;

/// The recorded topics: those given by name, and those that match a pattern, as soon as they are
/// published.
class TopicChoice {
 public:
  TopicChoice() = default;
  /// \param names of topics
  /// \param patterns regular expressions for whole names
  /// \param excluded regular expressions for whole names that patterns do not select
  /// \throws RecordingError if a name or an expression is invalid, or there are too many
  TopicChoice(const std::vector<std::string>& names, const std::vector<std::string>& patterns,
              const std::vector<std::string>& excluded);

  bool isEmpty() const { return names_.empty() && patterns_.empty(); }
  bool isFull() const { return names_.size() >= kMaxTopics; }  ///< patterns add no more
  bool contains(const std::string& name) const { return names_.count(name) != 0; }
  /// Returns whether a topic is one of these, or would be if it were published now.
  bool wouldTake(const std::string& name) const { return contains(name) || isWanted(name); }
  const std::set<std::string>& names() const { return names_; }

  /// Adds the published topics that match, except those with one of the prefixes.
  /// \returns whether there was a new one
  bool follow(const Publishers& publishers, const std::vector<std::string>& own_prefixes);

 private:
  bool isWanted(const std::string& name) const;

  std::set<std::string> names_;
  std::vector<std::regex> patterns_, excluded_;
};

}  // namespace process_visualizer::recorder
