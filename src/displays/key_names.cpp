// SPDX-License-Identifier: BSD-3-Clause
#include "key_names.hpp"

#include <QKeySequence>
#include <sstream>

namespace process_visualizer::displays {
namespace {

std::string nameOf(int key, Qt::KeyboardModifiers modifiers) {
  return QKeySequence(key | static_cast<int>(modifiers))
      .toString(QKeySequence::PortableText)
      .toStdString();
}

bool isLetter(int key) { return key >= Qt::Key_A && key <= Qt::Key_Z; }

/// Whether it is a printed sign other than a letter or a digit.
bool isSign(int key) {
  const bool is_digit = key >= Qt::Key_0 && key <= Qt::Key_9;
  return key > Qt::Key_Space && key < Qt::Key_Escape && !isLetter(key) && !is_digit;
}

}  // namespace

std::string wantedKey(int key, Qt::KeyboardModifiers modifiers,
                      const std::set<std::string>& wanted) {
  modifiers &= ~Qt::KeyboardModifiers(Qt::KeypadModifier);
  if (modifiers & ~Qt::KeyboardModifiers(Qt::ShiftModifier)) return {};
  std::string name = nameOf(key, modifiers);
  if (wanted.count(name) > 0) return name;
  const std::string sign = isSign(key) ? nameOf(key, Qt::NoModifier) : std::string();
  return wanted.count(sign) > 0 ? sign : std::string();
}

bool repeats(int key) { return !isLetter(key) && key != Qt::Key_Space && key != Qt::Key_Escape; }

std::set<std::string> lines(const std::string& text) {
  std::set<std::string> found;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    if (!line.empty()) found.insert(line);
  return found;
}

}  // namespace process_visualizer::displays
