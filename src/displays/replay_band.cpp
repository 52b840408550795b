// SPDX-License-Identifier: BSD-3-Clause
// RViz display ReplayBand: marks the window of a replay, and shows or hides it on request.

#include <process_visualizer/PlayerState.h>
#include <process_visualizer/ShowReplay.h>
#include <ros/callback_queue.h>
#include <ros/message_traits.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>
#include <ros/subscriber.h>
#include <rviz/display.h>
#include <rviz/display_context.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/ros_topic_property.h>
#include <rviz/view_manager.h>
#include <sensor_msgs/RegionOfInterest.h>
#include <std_msgs/String.h>

#include <QColor>
#include <QEvent>
#include <QFontMetrics>
#include <QLayout>
#include <QMainWindow>
#include <QMargins>
#include <QObject>
#include <QPainter>
#include <QPointer>
#include <QString>
#include <QTimer>
#include <QToolBar>
#include <QWidget>
#include <memory>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <string>

#include "camera.hpp"
#include "replay_text.hpp"
#include "replay_window.hpp"

namespace process_visualizer::displays {
namespace {

const QColor kReplayColor(0xf5, 0xa6, 0x23);

constexpr int kHeight = 34, kTextHeight = 21, kHintHeight = 14;  // px
constexpr int kTextGap = 12;                                     ///< between the texts, px
constexpr int kPlateInset = 4;                                   ///< of the plate from the band, px
const char* const kHint = "Cell still running; press Esc in the launcher to return";

QFont fontOf(const QWidget& widget, int height, QFont::Weight weight) {
  QFont font = widget.font();
  font.setPixelSize(height);
  font.setWeight(weight);
  return font;
}

int widthOf(const QString& text, const QPainter& painter) {
  return painter.fontMetrics().horizontalAdvance(text);
}

/// Draws the word on its plate at the left; returns the end of the plate.
int drawWord(const QRect& band, QPainter& painter) {
  const QString word = "REPLAY";
  const QRect plate(kPlateInset, kPlateInset, widthOf(word, painter) + 2 * kTextGap,
                    band.height() - 2 * kPlateInset);
  painter.setPen(Qt::NoPen);
  painter.setBrush(Qt::black);
  painter.drawRoundedRect(plate, 4, 4);
  painter.setPen(kReplayColor);
  painter.drawText(plate, Qt::AlignCenter, word);
  return plate.right();
}

/// Draws a text from `left` on; returns its end.
int drawText(const QString& text, int left, const QRect& band, QPainter& painter) {
  painter.setPen(Qt::black);
  painter.drawText(band.adjusted(left, 0, 0, 0), Qt::AlignLeft | Qt::AlignVCenter, text);
  return left + widthOf(text, painter);
}

}  // namespace

/// The content of the band: the word REPLAY on a plate, a text, and at the right a hint to return.
/// It paints itself, because a label would lay out RViz's window at every change of its text.
class ReplayRibbon : public QWidget {
 public:
  explicit ReplayRibbon(QWidget* parent) : QWidget(parent) {
    setFixedHeight(kHeight);
    setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
    setAttribute(Qt::WA_OpaquePaintEvent);
  }

  void setText(const QString& text) {
    if (text == text_) return;
    text_ = text;
    update();
  }

 protected:
  void paintEvent(QPaintEvent* /*event*/) override {
    QPainter painter(this);
    painter.setRenderHint(QPainter::Antialiasing);
    painter.fillRect(rect(), kReplayColor);
    painter.setFont(fontOf(*this, kTextHeight, QFont::Bold));
    const int left = drawWord(rect(), painter) + kTextGap;
    const int end = drawText(text_, left, rect(), painter);
    painter.setFont(fontOf(*this, kHintHeight, QFont::Normal));
    const int hint = width() - widthOf(kHint, painter) - kTextGap;
    if (hint > end + kTextGap) drawText(kHint, hint, rect(), painter);  // the time matters more
  }

 private:
  QString text_;
};

namespace {

constexpr int kFrame = 4;  ///< width of the frame, px

/// The first toolbar below the menu; nullptr if there is none.
QToolBar* firstOnTop(const QMainWindow& window) {
  for (QToolBar* bar : window.findChildren<QToolBar*>(QString(), Qt::FindDirectChildrenOnly)) {
    if (window.toolBarArea(bar) == Qt::TopToolBarArea) return bar;
  }
  return nullptr;
}

/// Creates a band that cannot be moved, or switched off in the menu of toolbars.
QToolBar* makeBand(QMainWindow& window) {
  auto* band = new QToolBar("Replay", &window);
  band->setObjectName("replay_band");  // QMainWindow::saveState() warns of toolbars without a name
  band->setMovable(false);
  band->setFloatable(false);
  band->setContextMenuPolicy(Qt::PreventContextMenu);
  band->toggleViewAction()->setVisible(false);
  band->setContentsMargins(0, 0, 0, 0);
  band->layout()->setContentsMargins(0, 0, 0, 0);
  band->layout()->setSpacing(0);
  return band;
}

}  // namespace

/// Marks RViz's window while this exists, so that nobody mistakes it for the live one: a band
/// across its top, and a frame of the same color around the scene.
class ReplayMark : public QObject {
 public:
  explicit ReplayMark(QMainWindow& window) {
    addBand(window);
    if (window.centralWidget()) addFrame(*window.centralWidget());
  }

  ~ReplayMark() override {
    delete band_.data();
    if (!framed_) return;
    framed_->removeEventFilter(this);
    framed_->setContentsMargins(former_margins_);
    framed_->update();
  }

  /// Sets the text beside the word REPLAY.
  void setText(const QString& text) {
    if (band_) ribbon_->setText(text);
  }

  /// Paints the frame.
  bool eventFilter(QObject* object, QEvent* event) override {
    if (object == framed_ && event->type() == QEvent::Paint) paintFrame();
    return QObject::eventFilter(object, event);
  }

 private:
  void addBand(QMainWindow& window) {
    QToolBar* const first = firstOnTop(window);
    band_ = makeBand(window);
    ribbon_ = new ReplayRibbon(band_);
    band_->addWidget(ribbon_);
    if (first) {
      window.insertToolBar(first, band_);
      window.insertToolBarBreak(first);
    } else {
      window.addToolBar(Qt::TopToolBarArea, band_);
    }
  }

  void addFrame(QWidget& scene) {
    framed_ = &scene;
    former_margins_ = scene.contentsMargins();
    scene.setContentsMargins(kFrame, kFrame, kFrame, kFrame);
    // Not with a style sheet, which would change the style of all widgets inside.
    scene.installEventFilter(this);
    scene.update();
  }

  void paintFrame() {
    QPainter painter(framed_);
    painter.fillRect(framed_->rect(), kReplayColor);
    // There are buttons beside the scene without a background of their own.
    painter.fillRect(framed_->contentsRect(), framed_->palette().window());
  }

  QPointer<QToolBar> band_;
  QPointer<QWidget> framed_;
  QMargins former_margins_;
  ReplayRibbon* ribbon_ = nullptr;  ///< belongs to the band
};

namespace {

constexpr int kPeriod_ms = 25;  ///< so that the window appears at once, and tenths tick evenly

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

/// RViz display for a second RViz in front of the live one that shows a replay of the last minutes.
/// It draws nothing in the scene. A band across the window and a frame around the scene mark it as
/// not live; the band shows how long ago the moment was, by the player's state.
///
/// The service `~show_replay` of the RViz node shows and hides the window. It can give it the
/// place, the camera (the live RViz's `~camera`) and the keys (KeyReport) of the live one; after
/// that the operator may move the camera. While hidden, RViz does nothing. A service also works
/// across ROS masters.
class ReplayBand : public rviz::Display {
 public:
  ReplayBand();

 protected:
  void onInitialize() override;
  void onEnable() override;
  void onDisable() override;

 private:
  void subscribeState();
  void takeState(const PlayerState& state);
  bool show(ShowReplay::Request& request, ShowReplay::Response& response);
  /// Handles messages and updates the text, even while RViz itself does nothing.
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

ReplayBand::ReplayBand()
    : state_topic_(new rviz::RosTopicProperty(
          "State Topic", "/bag_player/state",
          QString::fromStdString(ros::message_traits::datatype<PlayerState>()),
          "State of the player.", this)),
      shown_at_start_(new rviz::BoolProperty(
          "Shown At Start", true, "Show the window at the start, before a call of ~show_replay.",
          this)),
      node_("~") {
  connect(state_topic_, &rviz::Property::changed, this, [this] { subscribeState(); });
  connect(shown_at_start_, &rviz::Property::changed, this, [this] {
    if (window_) window_->setBeginsHidden(!shown_at_start_->getBool());
  });
  connect(&timer_, &QTimer::timeout, this, [this] { work(); });
}

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
  if (!window_) return;  // not initialized by RViz yet
  state_.reset();
  state_subscriber_ = node_.subscribe(state_topic_->getTopicStd(), 1, &ReplayBand::takeState, this);
}

void ReplayBand::takeState(const PlayerState& state) {
  state_ = {
      state.stamp.toSec(), state.since.toSec(), state.begin.toSec(), state.duration,
      state.position,      state.rate,          bool(state.paused),  ros::WallTime::now().toSec()};
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
