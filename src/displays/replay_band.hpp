// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <process_visualizer/PlayerState.h>
#include <process_visualizer/ShowReplay.h>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>
#include <ros/subscriber.h>
#include <rviz/display.h>

#include <QTimer>
#include <memory>
#include <optional>
#include <string>

#include "replay_mark.hpp"
#include "replay_text.hpp"
#include "replay_window.hpp"

namespace rviz {
class BoolProperty;
class RosTopicProperty;
}  // namespace rviz

namespace process_visualizer::displays {

/// RViz display for a second RViz that stands in front of the live one and shows what was a moment
/// ago. It draws nothing in the scene. A band across the window and a frame around the scene say
/// that this is not live, and how long ago it was: the player's state says it.
///
/// The window appears and disappears by the service `~show_replay` of the RViz node, which can give
/// it the place, the camera (`~camera` there) and the keys (KeyReport) of the live one; from then
/// on the operator may look from elsewhere. Hidden, RViz does nothing. A service reaches it from
/// another ROS master too.
class ReplayBand : public rviz::Display {
 public:
  ReplayBand();
  ~ReplayBand() override;

 protected:
  void onInitialize() override;
  void onEnable() override;
  void onDisable() override;

 private:
  void subscribeState();
  void takeState(const PlayerState& state);
  bool show(ShowReplay::Request& request, ShowReplay::Response& response);
  /// Takes messages and brings the text up to date, also while RViz itself does nothing.
  void work();
  void mark();
  void adoptCamera();

  rviz::RosTopicProperty* state_topic_;
  rviz::BoolProperty* shown_at_start_;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::Subscriber state_subscriber_;
  ros::Publisher place_publisher_, keys_publisher_;
  ros::ServiceServer service_;
  std::optional<PlayedState> state_;
  std::string camera_;
  ReplayText text_;
  std::unique_ptr<ReplayWindow> window_;
  std::unique_ptr<ReplayMark> mark_;
  QTimer timer_;
};

}  // namespace process_visualizer::displays
