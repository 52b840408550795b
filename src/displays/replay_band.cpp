// SPDX-License-Identifier: BSD-3-Clause
#include "replay_band.hpp"

#include <ros/message_traits.h>
#include <rviz/display_context.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/ros_topic_property.h>
#include <rviz/view_manager.h>

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

}  // namespace

ReplayBand::ReplayBand()
    : state_topic_(new rviz::RosTopicProperty("State Topic", "/bag_player/state",
                                              typeOf<PlayerState>(),
                                              "What the player says of itself.", this)),
      camera_topic_(
          new rviz::RosTopicProperty("Camera Topic", "/rviz/camera", typeOf<std_msgs::String>(),
                                     "The camera that the window has when it appears.", this)),
      shown_at_start_(new rviz::BoolProperty(
          "Shown At Start", true, "Whether the window appears before ~shown says so.", this)),
      node_("~") {
  connect(state_topic_, &rviz::Property::changed, this, [this] { subscribeState(); });
  connect(camera_topic_, &rviz::Property::changed, this, [this] { subscribeCamera(); });
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
  shown_subscriber_ = node_.subscribe("shown", 1, &ReplayBand::takeShown, this);
  subscribeState();
  subscribeCamera();
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

void ReplayBand::subscribeCamera() {
  if (!window_) return;  // RViz has not told yet where this is
  camera_.clear();
  camera_subscriber_ =
      node_.subscribe(camera_topic_->getTopicStd(), 1, &ReplayBand::takeCamera, this);
}

void ReplayBand::takeState(const PlayerState& state) {
  state_ = playedState(state, ros::WallTime::now().toSec());
}

void ReplayBand::takeCamera(const std_msgs::String& camera) {
  const bool is_first = camera_.empty();
  camera_ = camera.data;
  if (is_first) adoptCamera();
}

void ReplayBand::takeShown(const std_msgs::Bool& shown) {
  if (shown.data) {
    window_->show();
  } else {
    window_->hide();
  }
}

void ReplayBand::work() {
  queue_.callAvailable();
  window_->endWithRos();
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
