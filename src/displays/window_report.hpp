// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/publisher.h>

#include <QObject>
#include <QPointer>

class QWidget;

namespace process_visualizer::displays {

/// Publishes where a window is on `~window` (sensor_msgs/RegionOfInterest, latched), whenever it is
/// moved or resized: the corner of its frame, and its size without the frame, in pixels of the
/// screen, whatever Qt scales by. What is left of the screen or above it counts as its edge.
class WindowReport : public QObject {
 public:
  explicit WindowReport(QWidget& window);

  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  void publish();

  QPointer<QWidget> window_;
  ros::Publisher publisher_;
};

}  // namespace process_visualizer::displays
