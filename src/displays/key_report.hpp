// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <std_msgs/String.h>

#include <QObject>
#include <QPointer>
#include <set>
#include <string>

class QKeyEvent;
class QWidget;

namespace process_visualizer::displays {

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
