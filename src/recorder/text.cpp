// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/recorder/text.hpp"

#include <algorithm>
#include <cstdint>

namespace process_visualizer::recorder {
namespace {

constexpr std::size_t kMostListed = 5;
constexpr char kReplacement[] = "\xEF\xBF\xBD";

/// How long the character that begins with a byte is, by its leading ones; 0: none begins so.
std::size_t lengthOf(unsigned char first) {
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first < 0xE0) return 2;
  if (first >= 0xE0 && first < 0xF0) return 3;
  return first >= 0xF0 && first < 0xF5 ? 4 : 0;
}

/// Whether a character of this length and value may be: not longer than need be, no surrogate.
bool isCharacter(std::size_t length, std::uint32_t value) {
  if (length == 3) return value >= 0x800 && (value < 0xD800 || value > 0xDFFF);
  return length != 4 || (value >= 0x10000 && value <= 0x10FFFF);
}

/// The length of the character at a place; 0 if there is none.
std::size_t characterAt(const std::string& text, std::size_t place) {
  const unsigned char first = text[place];
  const std::size_t length = lengthOf(first);
  if (length < 2 || place + length > text.size()) return length == 1 ? 1 : 0;
  std::uint32_t value = first & (0x7F >> length);
  for (std::size_t i = 1; i < length; ++i) {
    const unsigned char next = text[place + i];
    if ((next & 0xC0) != 0x80) return 0;
    value = value << 6 | (next & 0x3F);
  }
  return isCharacter(length, value) ? length : 0;
}

}  // namespace

std::string joined(const std::vector<std::string>& words, const std::string& separator) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : separator) + word;
  return text;
}

std::string listed(const std::vector<std::string>& names) {
  if (names.size() <= kMostListed) return joined(names, ", ");
  const std::vector<std::string> first(names.begin(), names.begin() + kMostListed);
  return joined(first, ", ") + " and " + std::to_string(names.size() - kMostListed) + " more";
}

std::string validUtf8(const std::string& text) {
  std::string valid;
  for (std::size_t place = 0; place < text.size();) {
    const std::size_t length = characterAt(text, place);
    valid += length > 0 ? text.substr(place, length) : kReplacement;
    place += std::max<std::size_t>(length, 1);
  }
  return valid;
}

}  // namespace process_visualizer::recorder
