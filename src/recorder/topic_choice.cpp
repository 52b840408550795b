// SPDX-License-Identifier: BSD-3-Clause
// Compiles and matches the patterns of topics, within limits.

#include "process_visualizer/recorder/topic_choice.hpp"

#include <ros/names.h>

#include <algorithm>
#include <stdexcept>

#include "process_visualizer/common/required_name.hpp"
#include "process_visualizer/recorder/problems.hpp"

namespace process_visualizer::recorder {
namespace {

/// Maximum length of an expression: libstdc++ recurses for nested brackets.
constexpr std::size_t kMaxCharacters = 2000;
constexpr std::size_t kMaxExpressions = 100;
/// Without __polynomial, libstdc++ takes exponential time for (.*)*x.
constexpr auto kSyntax = std::regex::ECMAScript | std::regex_constants::__polynomial;

std::vector<std::regex> expressions(const std::vector<std::string>& texts) {
  if (texts.size() > kMaxExpressions)
    throw RecordingError(std::to_string(texts.size()) + " regular expressions are given; at most " +
                         std::to_string(kMaxExpressions) + " are allowed");
  std::vector<std::regex> compiled;
  for (const std::string& text : texts) {
    if (text.size() > kMaxCharacters)
      throw RecordingError("a regular expression has more than " + std::to_string(kMaxCharacters) +
                           " characters; name the topics");
    try {
      compiled.emplace_back(text, kSyntax);
    } catch (const std::regex_error& error) {
      throw RecordingError("\"" + text + "\" is not a regular expression: " + error.what());
    }
  }
  return compiled;
}

bool matchesAny(const std::string& name, const std::vector<std::regex>& expressions) {
  return std::any_of(expressions.begin(), expressions.end(),
                     [&](const std::regex& it) { return std::regex_match(name, it); });
}

}  // namespace

TopicChoice::TopicChoice(const std::vector<std::string>& names,
                         const std::vector<std::string>& patterns,
                         const std::vector<std::string>& excluded)
    : patterns_(expressions(patterns)), excluded_(expressions(excluded)) {
  if (names.size() > kMaxTopics)
    throw RecordingError(std::to_string(names.size()) + " topics are named; at most " +
                         std::to_string(kMaxTopics) + " are recorded at once");
  try {
    for (const std::string& name : names)
      names_.insert(ros::names::resolve("/", requiredName(name)));
  } catch (const std::invalid_argument& error) {
    throw RecordingError(error.what());
  } catch (const ros::InvalidNameException& error) {
    throw RecordingError(error.what());
  }
}

bool TopicChoice::follow(const Publishers& publishers,
                         const std::vector<std::string>& own_prefixes) {
  const std::size_t before = names_.size();
  for (const auto& [name, nodes] : publishers) {
    if (isFull()) break;
    const auto is_prefix = [&, &topic = name](const std::string& prefix) {
      return topic.compare(0, prefix.size(), prefix) == 0;
    };
    if (isWanted(name) && std::none_of(own_prefixes.begin(), own_prefixes.end(), is_prefix))
      names_.insert(name);
  }
  return names_.size() > before;
}

bool TopicChoice::isWanted(const std::string& name) const {
  return matchesAny(name, patterns_) && !matchesAny(name, excluded_);
}

}  // namespace process_visualizer::recorder
