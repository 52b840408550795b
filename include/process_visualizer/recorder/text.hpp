// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace process_visualizer::recorder {

/// Returns the words as one text, with the separator between them.
std::string joined(const std::vector<std::string>& words, const std::string& separator);

/// Names in a sentence: the first ones, and how many more there are.
std::string listed(const std::vector<std::string>& names);

/// Returns a text in which every byte that is not part of UTF-8 is replaced by U+FFFD.
std::string validUtf8(const std::string& text);

}  // namespace process_visualizer::recorder
