// SPDX-License-Identifier: BSD-3-Clause
#include "window_report.hpp"

#include <ros/node_handle.h>
#include <sensor_msgs/RegionOfInterest.h>

#include <QEvent>
#include <QWidget>
#include <algorithm>

namespace process_visualizer::displays {

WindowReport::WindowReport(QWidget& window) : window_(&window) {
  publisher_ =
      ros::NodeHandle("~").advertise<sensor_msgs::RegionOfInterest>("window", 1, /*latch=*/true);
  window.installEventFilter(this);
}

bool WindowReport::eventFilter(QObject* object, QEvent* event) {
  const QEvent::Type type = event->type();
  const bool is_change = type == QEvent::Move || type == QEvent::Resize || type == QEvent::Show;
  if (is_change && object == window_ && window_->isVisible() && !window_->isMinimized()) publish();
  return QObject::eventFilter(object, event);
}

void WindowReport::publish() {
  const double scale = window_->devicePixelRatioF();
  const auto pixels = [scale](int logical) { return std::max(qRound(scale * logical), 0); };
  sensor_msgs::RegionOfInterest place;
  place.x_offset = pixels(window_->x());
  place.y_offset = pixels(window_->y());
  place.width = pixels(window_->width());
  place.height = pixels(window_->height());
  publisher_.publish(place);
}

}  // namespace process_visualizer::displays
