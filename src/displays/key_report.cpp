// SPDX-License-Identifier: BSD-3-Clause
#include "key_report.hpp"

#include <ros/node_handle.h>

#include <QAbstractButton>
#include <QAbstractItemView>
#include <QAbstractSpinBox>
#include <QApplication>
#include <QComboBox>
#include <QKeyEvent>
#include <QLineEdit>
#include <QPlainTextEdit>
#include <QTextEdit>
#include <QWidget>

#include "key_names.hpp"

namespace process_visualizer::displays {
namespace {

constexpr int kMostPresses = 10;  ///< that wait to be sent

/// Whether a widget has a use for letters, arrows or the space bar.
bool usesKeys(const QWidget& widget) {
  return qobject_cast<const QLineEdit*>(&widget) ||
         qobject_cast<const QAbstractSpinBox*>(&widget) ||
         qobject_cast<const QTextEdit*>(&widget) || qobject_cast<const QPlainTextEdit*>(&widget) ||
         qobject_cast<const QComboBox*>(&widget) ||
         qobject_cast<const QAbstractItemView*>(&widget) ||
         qobject_cast<const QAbstractButton*>(&widget);
}

}  // namespace

KeyReport::KeyReport(QWidget& window) : window_(&window) {
  ros::NodeHandle handle("~");
  publisher_ = handle.advertise<std_msgs::String>("key_pressed", kMostPresses);
  subscriber_ = handle.subscribe<std_msgs::String>(
      "keys", 1, [this](const std_msgs::StringConstPtr& keys) { wanted_ = lines(keys->data); });
  QCoreApplication::instance()->installEventFilter(this);
}

bool KeyReport::eventFilter(QObject* object, QEvent* event) {
  if (event->type() == QEvent::KeyPress) {
    const auto* widget = qobject_cast<const QWidget*>(object);  // it reaches a QWindow before
    if (widget && takes(*widget) && pass(static_cast<const QKeyEvent&>(*event))) return true;
  }
  return QObject::eventFilter(object, event);
}

bool KeyReport::takes(const QWidget& widget) const {
  return window_ && widget.window() == window_ && !usesKeys(widget) &&
         !QApplication::activeModalWidget() && !QApplication::activePopupWidget() &&
         subscriber_.getNumPublishers() > 0;
}

bool KeyReport::pass(const QKeyEvent& press) const {
  const std::string name = wantedKey(press.key(), press.modifiers(), wanted_);
  if (name.empty()) return false;
  if (!press.isAutoRepeat() || repeats(press.key())) {
    std_msgs::String message;
    message.data = name;
    publisher_.publish(message);
  }
  return true;
}

}  // namespace process_visualizer::displays
