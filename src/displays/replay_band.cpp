// SPDX-License-Identifier: BSD-3-Clause
#include "replay_band.hpp"

#include <ros/message_traits.h>
#include <rviz/display_context.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/ros_topic_property.h>
#include <rviz/view_manager.h>
#include <sensor_msgs/RegionOfInterest.h>
#include <std_msgs/String.h>

#include <QMainWindow>
#include <pluginlib/class_list_macros.hpp>

#include "camera_text.hpp"

namespace process_visualizer::displays {
namespace {

constexpr int kPeriod_ms = 25;  ///< so that the window appears at once, and tenths tick evenly

template <typename Message>
QString typeOf() {
  return QString::fromStdString(ros::message_traits::datatype<Message>());
}

PlayedState playedState(const PlayerState& state, double now_s) {
  return {state.stamp.toSec(), state.since.toSec(), state.begin.toSec(), state.duration,
          state.position,      state.rate,          bool(state.paused),  now_s};
}

sensor_msgs::RegionOfInterest placeOf(const ShowReplay::Request& request) {
  sensor_msgs::RegionOfInterest place;
  place.x_offset = request.x;
  place.y_offset = request.y;
  place.width = request.width;
  place.height = request.height;
  return place;
}

std_msgs::String textMessage(const std::string& text) {
  std_msgs::String message;
  message.data = text;
  return message;
}

}  // namespace

ReplayBand::ReplayBand()
    : state_topic_(new rviz::RosTopicProperty("State Topic", "/bag_player/state",
                                              typeOf<PlayerState>(),
                                              "What the player says of itself.", this)),
      shown_at_start_(new rviz::BoolProperty(
          "Shown At Start", true, "Whether the window appears before ~show_replay says so.", this)),
      node_("~") {
  connect(state_topic_, &rviz::Property::changed, this, [this] { subscribeState(); });
  connect(shown_at_start_, &rviz::Property::changed, this, [this] {
    if (window_) window_->setBeginsHidden(!shown_at_start_->getBool());
  });
  connect(&timer_, &QTimer::timeout, this, [this] { work(); });
}

ReplayBand::~ReplayBand() = default;

void ReplayBand::onInitialize() {
  node_.setCallbackQueue(&queue_);
  window_ = std::make_unique<ReplayWindow>(*context_, [this] {
    mark();
    adoptCamera();
  });
  place_publisher_ = node_.advertise<sensor_msgs::RegionOfInterest>("place", 1);
  keys_publisher_ = node_.advertise<std_msgs::String>("keys", 1, /*latch=*/true);
  service_ = node_.advertiseService("show_replay", &ReplayBand::show, this);
  subscribeState();
  timer_.start(kPeriod_ms);
}

void ReplayBand::onEnable() {
  if (window_->isShown()) mark();
}

void ReplayBand::onDisable() { mark_.reset(); }

void ReplayBand::subscribeState() {
  if (!window_) return;  // RViz has not told yet where this is
  state_.reset();
  state_subscriber_ = node_.subscribe(state_topic_->getTopicStd(), 1, &ReplayBand::takeState, this);
}

void ReplayBand::takeState(const PlayerState& state) {
  state_ = playedState(state, ros::WallTime::now().toSec());
}

bool ReplayBand::show(ShowReplay::Request& request, ShowReplay::Response& response) {
  if (!request.camera.empty()) camera_ = request.camera;
  if (request.width > 0) place_publisher_.publish(placeOf(request));
  if (!request.keys.empty()) keys_publisher_.publish(textMessage(request.keys));
  if (request.shown) {
    window_->show();
  } else {
    window_->hide();
  }
  response.success = true;
  return true;
}

void ReplayBand::work() {
  queue_.callAvailable();
  window_->endWithRos();
  window_->awaitPicture();
  if (mark_ && window_->isShown())
    mark_->setText(QString::fromStdString(text_.at(state_, ros::WallTime::now().toSec())));
}

void ReplayBand::mark() {
  if (!isEnabled() || mark_ || !window_->window()) return;
  mark_ = std::make_unique<ReplayMark>(*window_->window());
  mark_->setText(QString::fromStdString(text_.at(state_, ros::WallTime::now().toSec())));
}

void ReplayBand::adoptCamera() {
  if (camera_.empty()) return;
  window_->keepUnmodified();
  const QString problem = displays::adoptCamera(camera_, *context_->getViewManager());
  if (problem.isEmpty()) {
    deleteStatus("Camera");
  } else {
    setStatus(rviz::StatusProperty::Warn, "Camera", "The camera cannot be adopted: " + problem);
  }
}

}  // namespace process_visualizer::displays

PLUGINLIB_EXPORT_CLASS(process_visualizer::displays::ReplayBand, rviz::Display)
