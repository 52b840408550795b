// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Keys pressed in RViz that are passed on to the launcher.

#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <std_msgs/String.h>

#include <QObject>
#include <QPointer>
#include <Qt>
#include <cstdint>
#include <optional>
#include <set>
#include <string>

class QKeyEvent;
class QWidget;

namespace process_visualizer::displays {

/// The name of a key press (as written by QKeySequence, such as "Shift+Space"), if it is in
/// `wanted`; empty otherwise, and for RViz's own presses (with Ctrl, Alt or Meta). Punctuation keys
/// such as "?" match with or without Shift, as keyboards differ.
std::string wantedKey(int key, Qt::KeyboardModifiers modifiers,
                      const std::set<std::string>& wanted);

/// Returns whether a held key repeats: keys that move by steps do. A letter or the space bar would
/// switch something on and off.
bool repeats(int key);

/// Returns whether a key moves the selection of a list, or opens and closes its items.
bool movesWithin(int key);

/// The non-empty lines of a text.
std::set<std::string> lines(const std::string& text);

/// Time from the moment the X server received an input event until the window handles it. The
/// server has a clock of its own: the event that was handled soonest counts as handled at once, and
/// so does one that seems to be a minute late, as after the suspension of one of two computers.
class InputAge {
 public:
  /// \param received_ms  time of an event (X server's clock; 0 is unknown), which may wrap around
  /// \param handled_ms  when it is handled, on any steady clock
  /// \returns s
  double of(std::uint32_t received_ms, std::uint32_t handled_ms);

 private:
  std::optional<std::uint32_t> offset_ms_;  ///< least of handled - received
};

/// Passes keys pressed in RViz on to the launcher, which has the keyboard only while its own window
/// is in front. `~keys` (std_msgs/String) lists the keys, one per line, as written by QKeySequence;
/// a press of one is published on `~key_pressed`, as its name and, on a second line, the wall time
/// at which it was pressed (s since the epoch), and does not reach RViz. RViz keeps all others,
/// those with Ctrl or Alt, input to a field or a dialog, and the keys that move within a list;
/// without a publisher on `~keys` it keeps all.
class KeyReport : public QObject {
 public:
  /// \param window RViz's window
  explicit KeyReport(QWidget& window);

  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  bool takes(const QWidget& widget, int key) const;
  /// \param age_s since the key was pressed
  bool pass(const QKeyEvent& press, double age_s) const;

  QPointer<QWidget> window_;
  ros::Publisher publisher_;
  ros::Subscriber subscriber_;
  std::set<std::string> wanted_;
  InputAge age_;
};

}  // namespace process_visualizer::displays
