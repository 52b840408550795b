// SPDX-License-Identifier: BSD-3-Clause
// Selection of the key presses that go to the launcher instead of RViz, and their age.

#include "key_report.hpp"

#include <ros/node_handle.h>

#include <QAbstractItemView>
#include <QAbstractSpinBox>
#include <QApplication>
#include <QComboBox>
#include <QKeyEvent>
#include <QKeySequence>
#include <QLineEdit>
#include <QPlainTextEdit>
#include <QTextEdit>
#include <QWidget>
#include <chrono>
#include <sstream>

namespace process_visualizer::displays {
namespace {

std::string nameOf(int key, Qt::KeyboardModifiers modifiers) {
  return QKeySequence(key | static_cast<int>(modifiers))
      .toString(QKeySequence::PortableText)
      .toStdString();
}

bool isLetter(int key) { return key >= Qt::Key_A && key <= Qt::Key_Z; }

/// Returns whether a key is punctuation: printable, but neither a letter nor a digit.
bool isSign(int key) {
  const bool is_digit = key >= Qt::Key_0 && key <= Qt::Key_9;
  return key > Qt::Key_Space && key < Qt::Key_Escape && !isLetter(key) && !is_digit;
}

}  // namespace

std::string wantedKey(int key, Qt::KeyboardModifiers modifiers,
                      const std::set<std::string>& wanted) {
  modifiers &= ~Qt::KeyboardModifiers(Qt::KeypadModifier);
  if (modifiers & ~Qt::KeyboardModifiers(Qt::ShiftModifier)) return {};
  std::string name = nameOf(key, modifiers);
  if (wanted.count(name) > 0) return name;
  const std::string sign = isSign(key) ? nameOf(key, Qt::NoModifier) : std::string();
  return wanted.count(sign) > 0 ? sign : std::string();
}

bool repeats(int key) { return !isLetter(key) && key != Qt::Key_Space && key != Qt::Key_Escape; }

bool movesWithin(int key) {
  switch (key) {
    case Qt::Key_Left:
    case Qt::Key_Right:
    case Qt::Key_Up:
    case Qt::Key_Down:
    case Qt::Key_Home:
    case Qt::Key_End:
    case Qt::Key_PageUp:
    case Qt::Key_PageDown:
    case Qt::Key_Plus:   // opens what is below an item
    case Qt::Key_Minus:  // closes it
      return true;
    default:
      return false;
  }
}

std::set<std::string> lines(const std::string& text) {
  std::set<std::string> found;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    if (!line.empty()) found.insert(line);
  return found;
}

constexpr std::int32_t kMaxLate_ms = 60'000;  ///< above this, one of the clocks was stopped

double InputAge::of(std::uint32_t received_ms, std::uint32_t handled_ms) {
  if (received_ms == 0) return 0.0;
  const std::uint32_t difference_ms = handled_ms - received_ms;
  const auto later_ms =
      static_cast<std::int32_t>(difference_ms - offset_ms_.value_or(difference_ms));
  if (!offset_ms_ || later_ms < 0 || later_ms > kMaxLate_ms) offset_ms_ = difference_ms;
  return 1e-3 * static_cast<double>(difference_ms - *offset_ms_);
}

namespace {

constexpr int kMaxPresses = 10;  ///< waiting to be sent

/// Returns whether text can be typed into a widget.
bool isField(const QWidget& widget) {
  const auto* box = qobject_cast<const QComboBox*>(&widget);
  return qobject_cast<const QLineEdit*>(&widget) ||
         qobject_cast<const QAbstractSpinBox*>(&widget) ||
         qobject_cast<const QTextEdit*>(&widget) || qobject_cast<const QPlainTextEdit*>(&widget) ||
         (box && box->isEditable());
}

/// Returns whether a widget itself uses the keys that move a selection.
bool usesNavigationKeys(const QWidget& widget) {
  return qobject_cast<const QAbstractItemView*>(&widget) || qobject_cast<const QComboBox*>(&widget);
}

std::uint32_t steadyMs() {
  using std::chrono::milliseconds;
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return static_cast<std::uint32_t>(std::chrono::duration_cast<milliseconds>(now).count());
}

}  // namespace

KeyReport::KeyReport(QWidget& window) : window_(&window) {
  ros::NodeHandle handle("~");
  publisher_ = handle.advertise<std_msgs::String>("key_pressed", kMaxPresses);
  subscriber_ = handle.subscribe<std_msgs::String>(
      "keys", 1, [this](const std_msgs::StringConstPtr& keys) { wanted_ = lines(keys->data); });
  QCoreApplication::instance()->installEventFilter(this);
}

bool KeyReport::eventFilter(QObject* object, QEvent* event) {
  const auto* widget = qobject_cast<const QWidget*>(object);  // a QWindow gets it first
  const QEvent::Type type = event->type();
  if (widget && (type == QEvent::KeyPress || type == QEvent::KeyRelease ||
                 type == QEvent::MouseMove || type == QEvent::MouseButtonPress)) {
    const auto& input = static_cast<const QInputEvent&>(*event);
    const double age_s = age_.of(static_cast<std::uint32_t>(input.timestamp()), steadyMs());
    if (type == QEvent::KeyPress) {
      const auto& press = static_cast<const QKeyEvent&>(*event);
      if (takes(*widget, press.key()) && pass(press, age_s)) return true;
    }
  }
  return QObject::eventFilter(object, event);
}

bool KeyReport::takes(const QWidget& widget, int key) const {
  return window_ && widget.window() == window_ && !isField(widget) &&
         !(usesNavigationKeys(widget) && movesWithin(key)) && !QApplication::activeModalWidget() &&
         !QApplication::activePopupWidget() && subscriber_.getNumPublishers() > 0;
}

bool KeyReport::pass(const QKeyEvent& press, double age_s) const {
  const std::string name = wantedKey(press.key(), press.modifiers(), wanted_);
  if (name.empty()) return false;
  if (!press.isAutoRepeat() || repeats(press.key())) {
    std_msgs::String message;
    message.data = name + "\n" + std::to_string(ros::WallTime::now().toSec() - age_s);
    publisher_.publish(message);
  }
  return true;
}

}  // namespace process_visualizer::displays
