// SPDX-License-Identifier: BSD-3-Clause
// RViz display DisplayStatus: status of all displays, silent topics, window, keys and camera.

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/names.h>
#include <ros/node_handle.h>
#include <ros/this_node.h>
#include <rviz/display.h>
#include <rviz/display_group.h>
#include <rviz/message_filter_display.h>
#include <rviz/properties/ros_topic_property.h>
#include <rviz/properties/status_list.h>
#include <rviz/render_panel.h>
#include <rviz/view_manager.h>
#include <rviz/visualization_manager.h>
#include <rviz/window_manager_interface.h>
#include <sensor_msgs/RegionOfInterest.h>
#include <std_msgs/Bool.h>
#include <std_msgs/String.h>

#include <QEvent>
#include <QGuiApplication>
#include <QObject>
#include <QPointer>
#include <QTimer>
#include <QWidget>
#include <QWindow>
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <string>
#include <vector>

#include "camera.hpp"
#include "key_report.hpp"
#include "labeled_markers.hpp"

namespace process_visualizer::displays {
namespace {

using diagnostic_msgs::DiagnosticStatus;
using diagnostic_msgs::KeyValue;
using sensor_msgs::RegionOfInterest;

constexpr std::chrono::milliseconds kReportPeriod{500};
constexpr float kLookPeriod = 0.1F;                       ///< between two checks of the camera, s
constexpr std::chrono::milliseconds kCoveredPeriod{250};  ///< of pictures, if covered

// Displays that have received nothing

/// The name of the line in a display's status for that.
const char* const kSilenceName = "Messages";

const rviz::StatusList* statusOf(const rviz::Display& display) {
  for (int i = 0; i < display.numChildren(); ++i) {
    if (const auto* list = dynamic_cast<const rviz::StatusList*>(display.childAt(i))) return list;
  }
  return nullptr;
}

const rviz::Property* childOf(const rviz::Property& parent, const QString& name) {
  for (int i = 0; i < parent.numChildren(); ++i) {
    if (parent.childAt(i)->getName() == name) return parent.childAt(i);
  }
  return nullptr;
}

/// The text of a line of a display's status; empty if there is none.
QString statusText(const rviz::Display& display, const QString& name) {
  const rviz::StatusList* list = statusOf(display);
  const rviz::Property* line = list ? childOf(*list, name) : nullptr;
  return line ? line->getValue().toString() : QString();
}

/// Returns whether RViz itself reports a problem of the display, which may have received what it
/// cannot show.
bool hasFault(const rviz::Display& display) {
  const rviz::StatusList* list = statusOf(display);
  for (int i = 0; list && i < list->numChildren(); ++i) {
    const auto* line = dynamic_cast<const rviz::StatusProperty*>(list->childAt(i));
    if (line && line->getName() != kSilenceName && line->getLevel() != rviz::StatusProperty::Ok)
      return true;
  }
  return false;
}

/// Returns whether this process has subscribed to a topic or, for images, one with the suffix of a
/// transport.
bool isSubscribed(const std::string& topic) {
  ros::V_string topics;
  ros::this_node::getSubscribedTopics(topics);
  return std::any_of(topics.begin(), topics.end(), [&](const std::string& one) {
    return one == topic || one.compare(0, topic.size() + 1, topic + "/") == 0;
  });
}

/// Returns whether no message has come. RViz itself does not warn about that: it reports messages
/// only from the first one on. A first cloud without points does not count: depth_proc sends it to
/// clear old ones.
bool hasReceivedNothing(const rviz::Display& display) {
  if (dynamic_cast<const rviz::_RosTopicDisplay*>(&display)) {
    const QString text = statusText(display, "Topic");
    return text.isEmpty() || text == "OK" ||
           (text == "1 messages received" &&
            statusText(display, "Points").startsWith("Showing [0] points"));
  }
  return statusText(display, "Depth Map").startsWith("0 ");
}

/// Returns whether no marker has come. RViz's own displays do not count markers, but list their
/// namespaces.
bool hasNoMarker(const rviz::Display& display) {
  if (const auto* own = dynamic_cast<const LabeledMarkers*>(&display)) return !own->hasReceived();
  const rviz::Property* namespaces = childOf(display, "Namespaces");
  return namespaces && childOf(display, "Marker Topic") && namespaces->numChildren() == 0;
}

/// The full name of a display's first topic; empty if there is none or if the name is invalid,
/// about which RViz itself warns.
std::string topicOf(const rviz::Display& display) {
  for (int i = 0; i < display.numChildren(); ++i) {
    const auto* topic = dynamic_cast<const rviz::RosTopicProperty*>(display.childAt(i));
    std::string error;
    if (topic && !topic->getTopicStd().empty() && ros::names::validate(topic->getTopicStd(), error))
      return ros::names::resolve(topic->getTopicStd());
  }
  return "";
}

/// Returns why a display shows nothing of its topic: it has not subscribed to it, or has
/// received nothing yet. Empty if it has, if it is disabled or has no topic, if RViz itself warns,
/// and for interactive markers, which may have no server while nobody needs one. Call this and the
/// following only in RViz's GUI thread.
std::string silence(const rviz::Display& display) {
  const std::string topic = topicOf(display);
  if (!display.isEnabled() || topic.empty()) return "";
  if (!isSubscribed(topic)) return "No messages received: RViz has not subscribed to " + topic;
  if (hasFault(display)) return "";
  if (hasReceivedNothing(display)) return "No messages received on " + topic;
  return hasNoMarker(display) ? "No markers received on " + topic : "";
}

/// Shows or removes a warning in the status of a display that has received nothing.
void showSilence(rviz::Display& display) {
  const QString text = QString::fromStdString(silence(display));
  const QString shown = statusText(display, kSilenceName);
  if (text == shown) return;
  if (text.isEmpty()) {
    display.deleteStatus(kSilenceName);
  } else {
    display.setStatus(rviz::StatusProperty::Warn, kSilenceName, text);
  }
}

/// The same for every display below `group`.
void showSilences(const rviz::DisplayGroup& group) {
  for (int i = 0; i < group.numDisplays(); ++i) {
    rviz::Display& display = *group.getDisplayAt(i);
    showSilence(display);
    if (const auto* subgroup = dynamic_cast<const rviz::DisplayGroup*>(&display))
      showSilences(*subgroup);
  }
}

// Reports of displays

KeyValue keyValue(const std::string& key, const std::string& value) {
  KeyValue entry;
  entry.key = key;
  entry.value = value;
  return entry;
}

/// Adds a line of a display's status; the report's level becomes the worst of its lines.
void addLine(const std::string& name, rviz::StatusProperty::Level level, const std::string& text,
             DiagnosticStatus& report) {
  report.values.push_back(
      keyValue(name, rviz::StatusProperty::statusWord(level).toStdString() + ": " + text));
  if (level == rviz::StatusProperty::Ok) return;
  report.level = std::max<int>(report.level, level);
  report.message += (report.message.empty() ? "" : "; ") + name + ": " + text;
}

/// Adds the lines of RViz's status, except for our own: its text may be one update old.
void addLines(const rviz::StatusList& list, DiagnosticStatus& report) {
  for (int i = 0; i < list.numChildren(); ++i) {
    const auto* line = dynamic_cast<const rviz::StatusProperty*>(list.childAt(i));
    if (!line || line->getNameStd() == kSilenceName) continue;
    addLine(line->getNameStd(), line->getLevel(), line->getValue().toString().toStdString(),
            report);
  }
}

/// Reports the status of a display, level and texts, and whether it has received nothing. RViz's
/// levels ok, warning and error have the same numbers as in DiagnosticStatus.
DiagnosticStatus reportDisplay(const rviz::Display& display, const std::string& name) {
  DiagnosticStatus report;
  report.name = name;
  report.hardware_id = display.getClassId().toStdString();
  report.values.push_back(keyValue("enabled", display.isEnabled() ? "true" : "false"));
  if (!display.isEnabled()) return report;
  for (int i = 0; i < display.numChildren(); ++i) {
    const auto* list = dynamic_cast<const rviz::StatusList*>(display.childAt(i));
    if (list) addLines(*list, report);
  }
  const std::string text = silence(display);
  if (!text.empty()) addLine(kSilenceName, rviz::StatusProperty::Warn, text, report);
  return report;
}

/// Reports every display below `group`, including those in subgroups, named "Group/Display".
std::vector<DiagnosticStatus> reportDisplays(const rviz::DisplayGroup& group,
                                             const std::string& prefix = "") {
  std::vector<DiagnosticStatus> reports;
  for (int i = 0; i < group.numDisplays(); ++i) {
    const rviz::Display& display = *group.getDisplayAt(i);
    const std::string name = prefix + display.getNameStd();
    reports.push_back(reportDisplay(display, name));
    if (const auto* subgroup = dynamic_cast<const rviz::DisplayGroup*>(&display)) {
      const auto children = reportDisplays(*subgroup, name + "/");
      reports.insert(reports.end(), children.begin(), children.end());
    }
  }
  return reports;
}

}  // namespace

/// Place of a window. It is published on `~window` (sensor_msgs/RegionOfInterest, latched) whenever
/// the window is moved or resized; positions left of the screen or above it count as 0. The window
/// is moved to the place received on `~place` (the same type): only the process that owns a window
/// can move it on every window system. Both give the corner of the window's frame, and its size
/// without the frame, in pixels of the screen, without Qt's scaling.
class WindowPlace : public QObject {
 public:
  explicit WindowPlace(QWidget& window) : window_(&window) {
    ros::NodeHandle node("~");
    publisher_ = node.advertise<RegionOfInterest>("window", 1, /*latch=*/true);
    const auto take = [this](const sensor_msgs::RegionOfInterestConstPtr& place) {
      wanted_ = *place;
    };
    subscriber_ = node.subscribe<RegionOfInterest>("place", 1, take);
    window.installEventFilter(this);
  }

  /// Moves to the last requested place, once the window is on the screen: before, the size of its
  /// frame is unknown.
  void follow() {
    if (!wanted_ || !window_ || !window_->windowHandle() || !window_->windowHandle()->isExposed())
      return;
    const double scale = window_->devicePixelRatioF();
    window_->resize(qRound(wanted_->width / scale), qRound(wanted_->height / scale));
    window_->move(qRound(wanted_->x_offset / scale), qRound(wanted_->y_offset / scale));
    wanted_.reset();
  }

  bool eventFilter(QObject* object, QEvent* event) override {
    const QEvent::Type type = event->type();
    const bool is_change = type == QEvent::Move || type == QEvent::Resize || type == QEvent::Show;
    if (is_change && object == window_ && window_->isVisible() && !window_->isMinimized())
      publish();
    return QObject::eventFilter(object, event);
  }

 private:
  void publish() {
    const double scale = window_->devicePixelRatioF();
    const auto pixels = [scale](int logical) { return std::max(qRound(scale * logical), 0); };
    RegionOfInterest place;
    place.x_offset = pixels(window_->x());
    place.y_offset = pixels(window_->y());
    place.width = pixels(window_->width());
    place.height = pixels(window_->height());
    publisher_.publish(place);
  }

  QPointer<QWidget> window_;
  ros::Publisher publisher_;
  ros::Subscriber subscriber_;
  std::optional<RegionOfInterest> wanted_;
};

/// Draws only four pictures a second while another window covers RViz's, so that the other window
/// gets the processor. The program of that window reports this on `~covered` (std_msgs/Bool,
/// latched).
class CoveredPace : public QObject {
 public:
  explicit CoveredPace(rviz::VisualizationManager& manager) : manager_(&manager) {
    subscriber_ = ros::NodeHandle("~").subscribe<std_msgs::Bool>(
        "covered", 1, [this](const std_msgs::BoolConstPtr& it) { is_covered_ = it->data; });
    timer_.setSingleShot(true);
    connect(&timer_, &QTimer::timeout, this, [this] { manager_->startUpdate(); });
  }

  /// Pauses before the next picture if the window is covered. Call this for each picture.
  void follow() {
    is_covered_ = is_covered_ && subscriber_.getNumPublishers() > 0;
    if (!is_covered_ || timer_.isActive()) return;
    manager_->stopUpdate();
    timer_.start(kCoveredPeriod);
  }

 private:
  rviz::VisualizationManager* manager_;
  ros::Subscriber subscriber_;
  QTimer timer_;
  bool is_covered_ = false;
};

/// RViz display that draws nothing. It adds a warning to the status of each display that has not
/// received anything, which RViz alone reports as OK. Twice a second, while RViz's window responds
/// (even if this display is disabled), it publishes the status of all displays on `~display_status`
/// of the RViz node (diagnostic_msgs/DiagnosticArray, latched): first an entry "rviz" with the
/// global status, the number of rendered `frames`, `fps`, and the `width` and `height` of the 3D
/// view in pixels, then an entry for each display.
///
/// On `~camera` (std_msgs/String, latched) it publishes the current camera when that has changed,
/// at most ten times a second. It publishes and sets the place of RViz's window (see WindowPlace),
/// passes keys on to the launcher (see KeyReport), and skips pictures that nobody sees (see
/// CoveredPace).
class DisplayStatus : public rviz::Display {
 public:
  void update(float wall_dt, float ros_dt) override;

 protected:
  void onInitialize() override;

 private:
  /// Stops drawing when the last window is closed. RViz would otherwise draw once more into the
  /// destroyed window, for which Mesa gets no size, and write outside the picture; this crashed
  /// RViz now and then.
  void stopDrawingAtTheEnd();
  void publishCamera();
  void publishReport();
  diagnostic_msgs::DiagnosticStatus reportRviz() const;

  ros::Publisher publisher_, camera_publisher_;
  std::unique_ptr<WindowPlace> window_place_;
  std::unique_ptr<KeyReport> key_report_;
  std::unique_ptr<CoveredPace> covered_pace_;
  std::string published_camera_;
  float seconds_since_camera_ = 0;
  QTimer report_timer_;
  ros::WallTime reported_ = ros::WallTime::now();
  std::uint64_t frames_at_report_ = 0;
};

void DisplayStatus::onInitialize() {
  ros::NodeHandle node("~");
  publisher_ =
      node.advertise<diagnostic_msgs::DiagnosticArray>("display_status", 1, /*latch=*/true);
  camera_publisher_ = node.advertise<std_msgs::String>("camera", 1, /*latch=*/true);
  rviz::WindowManagerInterface* manager = context_->getWindowManager();
  // RViz may be embedded in another program, without a window of its own.
  if (QWidget* const parent = manager ? manager->getParentWindow() : nullptr) {
    window_place_ = std::make_unique<WindowPlace>(*parent->window());
    key_report_ = std::make_unique<KeyReport>(*parent->window());
    context_->getViewManager()->getRenderPanel()->setFocus();  // instead of the list of displays
  }
  stopDrawingAtTheEnd();
  connect(&report_timer_, &QTimer::timeout, this, [this] { publishReport(); });
  report_timer_.start(kReportPeriod);
}

void DisplayStatus::stopDrawingAtTheEnd() {
  auto* manager = dynamic_cast<rviz::VisualizationManager*>(context_);
  const auto* application = qobject_cast<QGuiApplication*>(QCoreApplication::instance());
  if (!manager || !application) return;
  covered_pace_ = std::make_unique<CoveredPace>(*manager);
  connect(application, &QGuiApplication::lastWindowClosed, this, [this, manager] {
    covered_pace_.reset();
    manager->stopUpdate();
  });
}

void DisplayStatus::update(float wall_dt, float /*ros_dt*/) {
  if (window_place_) window_place_->follow();
  if (covered_pace_) covered_pace_->follow();
  seconds_since_camera_ += wall_dt;
  if (seconds_since_camera_ >= kLookPeriod) publishCamera();
}

void DisplayStatus::publishCamera() {
  seconds_since_camera_ = 0;
  std_msgs::String message;
  message.data = cameraText(*context_->getViewManager());
  if (message.data == published_camera_) return;
  camera_publisher_.publish(message);
  published_camera_ = message.data;
}

void DisplayStatus::publishReport() {
  showSilences(*context_->getRootDisplayGroup());
  diagnostic_msgs::DiagnosticArray report;
  report.header.stamp = ros::Time::now();
  report.status = reportDisplays(*context_->getRootDisplayGroup());
  report.status.insert(report.status.begin(), reportRviz());
  publisher_.publish(report);
  frames_at_report_ = context_->getFrameCount();
  reported_ = ros::WallTime::now();
}

DiagnosticStatus DisplayStatus::reportRviz() const {
  auto report = reportDisplay(*context_->getRootDisplayGroup(), "rviz");
  const rviz::RenderPanel& panel = *context_->getViewManager()->getRenderPanel();
  const std::uint64_t frames = context_->getFrameCount();
  report.values.push_back(keyValue("frames", std::to_string(frames)));
  const double passed_s = (ros::WallTime::now() - reported_).toSec();
  const double fps = static_cast<double>(frames - frames_at_report_) / std::max(passed_s, 0.001);
  report.values.push_back(keyValue("fps", std::to_string(fps)));
  report.values.push_back(keyValue("width", std::to_string(panel.width())));
  report.values.push_back(keyValue("height", std::to_string(panel.height())));
  return report;
}

}  // namespace process_visualizer::displays

PLUGINLIB_EXPORT_CLASS(process_visualizer::displays::DisplayStatus, rviz::Display)
