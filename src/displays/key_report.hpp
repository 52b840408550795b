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

/// The name under which a program has a key among its shortcuts (as QKeySequence writes it, such as
/// "Shift+Space"), if `wanted` has it; empty if not, or if the press is RViz's own (with Ctrl, Alt
/// or Meta). Signs such as "?" are wanted whether or not the keyboard needs Shift for them.
std::string wantedKey(int key, Qt::KeyboardModifiers modifiers,
                      const std::set<std::string>& wanted);

/// Returns whether a key that is held is pressed again and again: those that move by steps. A
/// letter or the space bar would switch something on and off.
bool repeats(int key);

/// The lines of a text, without empty ones.
std::set<std::string> lines(const std::string& text);

/// Passes keys that are pressed in RViz on to the launcher, which has the keyboard only while its
/// own window is in front. `~keys` (std_msgs/String) says which, one a line as QKeySequence writes
/// them; such a press is published on `~key_pressed` instead of reaching RViz. All others, those
/// with Ctrl or Alt, and what is typed into a field, a list or a dialog, remain RViz's, as do all
/// keys when nobody publishes on `~keys`.
class KeyReport : public QObject {
 public:
  /// \param window RViz's window
  explicit KeyReport(QWidget& window);

  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  bool takes(const QWidget& widget) const;
  bool pass(const QKeyEvent& press) const;

  QPointer<QWidget> window_;
  ros::Publisher publisher_;
  ros::Subscriber subscriber_;
  std::set<std::string> wanted_;
};

}  // namespace process_visualizer::displays
