// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/publisher.h>

#include <string>

namespace rviz {
class ViewManager;
}

namespace process_visualizer::displays {

/// Publishes RViz's present camera on `~camera` (std_msgs/String, latched) when it has changed, ten
/// times a second at most.
class CameraReport {
 public:
  void advertise();
  /// To be called at each picture; `wall_dt` [s] since the last one.
  void update(float wall_dt, const rviz::ViewManager& views);

 private:
  ros::Publisher publisher_;
  std::string published_;
  float seconds_since_look_ = 0;
};

}  // namespace process_visualizer::displays
