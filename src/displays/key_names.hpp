// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Qt>
#include <set>
#include <string>

namespace process_visualizer::displays {

/// The name under which a program has a key among its shortcuts (as QKeySequence writes it, such as
/// "Shift+Space"), if `wanted` has it; empty if not, or if the press is RViz's own (with Ctrl, Alt
/// or Meta). Signs such as "?" are wanted whether or not the keyboard needs Shift for them.
std::string wantedKey(int key, Qt::KeyboardModifiers modifiers,
                      const std::set<std::string>& wanted);

/// Whether a key that is held is pressed again and again: those that move by steps. A letter or the
/// space bar would switch something on and off.
bool repeats(int key);

/// The lines of a text, without empty ones.
std::set<std::string> lines(const std::string& text);

}  // namespace process_visualizer::displays
