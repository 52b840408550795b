// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <diagnostic_msgs/DiagnosticStatus.h>
#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <rviz/display.h>
#include <sensor_msgs/RegionOfInterest.h>

#include <cstdint>
#include <memory>

#include "camera_report.hpp"
#include "key_report.hpp"
#include "window_report.hpp"

class QWidget;

namespace process_visualizer::displays {

/// RViz display that draws nothing. It warns in the status of each display that has not received
/// anything, where RViz alone calls that OK. Twice a second it publishes what RViz shows of its
/// displays on
/// `~display_status` of the RViz node (diagnostic_msgs/DiagnosticArray, latched): first an entry
/// "rviz" with the global status, the count of rendered `frames`, `fps`, and the `width` and
/// `height` of the 3D view in pixels, then one entry for each display.
///
/// On `~camera` it publishes the present camera (see CameraReport), and on `~window` where RViz's
/// window is (see WindowReport). Keys for the launcher are passed on to it (see KeyReport).
///
/// It moves RViz's window to where `~place` (sensor_msgs/RegionOfInterest) says: the corner of its
/// frame, and its size without the frame, in pixels of the screen, whatever Qt scales by. Only the
/// process that owns a window can move it without knowing which window system that is.
class DisplayStatus : public rviz::Display {
 public:
  void update(float wall_dt, float ros_dt) override;

 protected:
  void onInitialize() override;

 private:
  /// RViz would draw once more after its window is gone, into memory that is no picture's: Mesa
  /// takes a window that it cannot ask for its size to have none. That ended RViz now and then.
  void stopDrawingAtTheEnd();
  /// RViz's window; none if it is a part of another program.
  QWidget* window() const;
  void place(const sensor_msgs::RegionOfInterest& place);
  /// Waits until the window is on the screen: before, the size of its frame is not known.
  void goToPlace();
  void publishReport();
  diagnostic_msgs::DiagnosticStatus reportRviz() const;

  ros::Publisher publisher_;
  ros::Subscriber subscriber_;
  CameraReport camera_;
  std::unique_ptr<WindowReport> window_report_;
  std::unique_ptr<KeyReport> key_report_;
  sensor_msgs::RegionOfInterest place_;
  bool is_place_new_ = false;
  float seconds_since_report_ = 0;
  std::uint64_t frames_at_report_ = 0;
};

}  // namespace process_visualizer::displays
