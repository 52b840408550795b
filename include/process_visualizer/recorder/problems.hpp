// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Errors of the recorder, and the list of its latest problems for its state.

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace process_visualizer::recorder {

/// Error: a recording cannot be written; the text names the file, the reason, and what to do.
class RecordingError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Returns the words as one text, with the separator between them.
inline std::string joined(const std::vector<std::string>& words, const std::string& separator) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : separator) + word;
  return text;
}

/// Returns names as part of a sentence: the first ones, and the number of others.
inline std::string listed(const std::vector<std::string>& names) {
  constexpr std::ptrdiff_t kMax = 5;
  const auto more = static_cast<std::ptrdiff_t>(names.size()) - kMax;
  if (more <= 0) return joined(names, ", ");
  return joined({names.begin(), names.begin() + kMax}, ", ") + " and " + std::to_string(more) +
         " more";
}

/// Problems of a recorder: the newest texts, and the number since the node started.
class Problems {
 public:
  static constexpr std::size_t kMax = 20;  ///< number of remembered problems

  /// \param present text that follows it until `settle`
  void add(const std::string& text, const std::string& present = "") {
    problems_.push_back({text, present});
    ++count_;
    if (problems_.size() > kMax) problems_.erase(problems_.begin());
  }
  void settle() {  ///< removes the texts about the present; past events stay
    for (Problem& problem : problems_) problem.present.clear();
  }
  void clear() { problems_.clear(); }       ///< removes the texts; the count continues
  std::vector<std::string> texts() const {  ///< the newest last
    std::vector<std::string> texts;
    texts.reserve(problems_.size());
    for (const Problem& problem : problems_) texts.push_back(problem.text + problem.present);
    return texts;
  }
  std::uint32_t count() const { return count_; }

 private:
  struct Problem {
    std::string text, present;
  };
  std::vector<Problem> problems_;
  std::uint32_t count_ = 0;
};

}  // namespace process_visualizer::recorder
