// SPDX-License-Identifier: BSD-3-Clause
#include "display_status.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <rviz/display_group.h>
#include <rviz/render_panel.h>
#include <rviz/view_manager.h>
#include <rviz/visualization_manager.h>
#include <rviz/window_manager_interface.h>

#include <QGuiApplication>
#include <QWidget>
#include <QWindow>
#include <pluginlib/class_list_macros.hpp>

#include "display_report.hpp"
#include "display_silence.hpp"

namespace process_visualizer::displays {
namespace {

constexpr float kReportPeriod = 0.5;  ///< between two reports, s

template <typename Value>
diagnostic_msgs::KeyValue keyValue(const std::string& key, Value value) {
  diagnostic_msgs::KeyValue entry;
  entry.key = key;
  entry.value = std::to_string(value);
  return entry;
}

/// Shows of every display below `group` that it has received nothing.
void showSilences(const rviz::DisplayGroup& group) {
  for (int i = 0; i < group.numDisplays(); ++i) {
    rviz::Display& display = *group.getDisplayAt(i);
    showSilence(display);
    if (const auto* subgroup = dynamic_cast<const rviz::DisplayGroup*>(&display))
      showSilences(*subgroup);
  }
}

}  // namespace

void DisplayStatus::onInitialize() {
  publisher_ = ros::NodeHandle("~").advertise<diagnostic_msgs::DiagnosticArray>("display_status", 1,
                                                                                /*latch=*/true);
  subscriber_ = ros::NodeHandle("~").subscribe("place", 1, &DisplayStatus::place, this);
  camera_.advertise();
  if (QWidget* const own = window()) {
    window_report_ = std::make_unique<WindowReport>(*own);
    key_report_ = std::make_unique<KeyReport>(*own);
    context_->getViewManager()->getRenderPanel()->setFocus();  // not in the list of displays
  }
  stopDrawingAtTheEnd();
}

QWidget* DisplayStatus::window() const {
  rviz::WindowManagerInterface* manager = context_->getWindowManager();
  QWidget* parent = manager ? manager->getParentWindow() : nullptr;
  return parent ? parent->window() : nullptr;
}

void DisplayStatus::place(const sensor_msgs::RegionOfInterest& place) {
  place_ = place;
  is_place_new_ = true;
}

void DisplayStatus::goToPlace() {
  QWidget* const own = window();
  if (!own || !own->windowHandle() || !own->windowHandle()->isExposed()) return;
  is_place_new_ = false;
  const double scale = own->devicePixelRatioF();
  own->resize(qRound(place_.width / scale), qRound(place_.height / scale));
  own->move(qRound(place_.x_offset / scale), qRound(place_.y_offset / scale));
}

void DisplayStatus::stopDrawingAtTheEnd() {
  auto* manager = dynamic_cast<rviz::VisualizationManager*>(context_);
  const auto* application = qobject_cast<QGuiApplication*>(QCoreApplication::instance());
  if (!manager || !application) return;
  connect(application, &QGuiApplication::lastWindowClosed, this,
          [manager] { manager->stopUpdate(); });
}

void DisplayStatus::update(float wall_dt, float /*ros_dt*/) {
  if (is_place_new_) goToPlace();
  camera_.update(wall_dt, *context_->getViewManager());
  seconds_since_report_ += wall_dt;
  if (seconds_since_report_ < kReportPeriod) return;
  publishReport();
  frames_at_report_ = context_->getFrameCount();
  seconds_since_report_ = 0;
}

void DisplayStatus::publishReport() {
  showSilences(*context_->getRootDisplayGroup());
  diagnostic_msgs::DiagnosticArray report;
  report.header.stamp = ros::Time::now();
  report.status = reportDisplays(*context_->getRootDisplayGroup());
  report.status.insert(report.status.begin(), reportRviz());
  publisher_.publish(report);
}

diagnostic_msgs::DiagnosticStatus DisplayStatus::reportRviz() const {
  auto report = reportDisplay(*context_->getRootDisplayGroup(), "rviz");
  const rviz::RenderPanel& panel = *context_->getViewManager()->getRenderPanel();
  const std::uint64_t frames = context_->getFrameCount();
  report.values.push_back(keyValue("frames", frames));
  report.values.push_back(keyValue("fps", (frames - frames_at_report_) / seconds_since_report_));
  report.values.push_back(keyValue("width", panel.width()));
  report.values.push_back(keyValue("height", panel.height()));
  return report;
}

}  // namespace process_visualizer::displays

PLUGINLIB_EXPORT_CLASS(process_visualizer::displays::DisplayStatus, rviz::Display)
