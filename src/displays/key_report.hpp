// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <std_msgs/String.h>

#include <QObject>
#include <QPointer>
#include <Qt>
#include <set>
#include <string>

class QKeyEvent;
class QWidget;

namespace process_visualizer::displays {

/// The name of a key press (as written by QKeySequence, such as "Shift+Space"), if it is in
/// `wanted`; empty otherwise, and for RViz's own presses (with Ctrl, Alt or Meta). Signs such as
/// "?" match with or without Shift, as keyboards differ.
std::string wantedKey(int key, Qt::KeyboardModifiers modifiers,
                      const std::set<std::string>& wanted);

/// Returns whether a held key repeats: keys that move by steps do. A letter or the space bar would
/// switch something on and off.
bool repeats(int key);

/// Returns whether a key moves the selection of a list, or opens and closes its items.
bool movesWithin(int key);

/// The non-empty lines of a text.
std::set<std::string> lines(const std::string& text);

/// Passes keys pressed in RViz on to the launcher, which has the keyboard only while its own window
/// is in front. `~keys` (std_msgs/String) lists the keys, one per line, as written by QKeySequence;
/// a press of one is published on `~key_pressed` and does not reach RViz. RViz keeps all others,
/// those with Ctrl or Alt, input to a field or a dialog, and the keys that move within a list;
/// without a publisher on `~keys` it keeps all.
class KeyReport : public QObject {
 public:
  /// \param window RViz's window
  explicit KeyReport(QWidget& window);

  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  bool takes(const QWidget& widget, int key) const;
  bool pass(const QKeyEvent& press) const;

  QPointer<QWidget> window_;
  ros::Publisher publisher_;
  ros::Subscriber subscriber_;
  std::set<std::string> wanted_;
};

}  // namespace process_visualizer::displays
