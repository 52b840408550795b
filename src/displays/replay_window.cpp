// SPDX-License-Identifier: BSD-3-Clause
// Shows and hides RViz's window without side effects; covers it until the first picture is drawn.

#include "replay_window.hpp"

#include <ros/init.h>
#include <rviz/visualization_manager.h>
#include <rviz/window_manager_interface.h>

#include <QCoreApplication>
#include <QDockWidget>
#include <QEvent>
#include <QLabel>
#include <QMainWindow>
#include <QSignalBlocker>
#include <QTimer>
#include <QWindow>
#include <functional>
#include <utility>
#include <vector>

namespace process_visualizer::displays {
namespace {

constexpr double kSoon_s = 1;  ///< after which the elapsed time is shown

}  // namespace

/// Covers a scene that has not been drawn yet, with a message: models are loaded while the first
/// picture is drawn, and the window would be black until then.
class ReplayCurtain : public QLabel {
 public:
  /// \param scene the covered widget
  /// \param seen called once, after the first paint: drawing may begin
  ReplayCurtain(QWidget& scene, std::function<void()> seen)
      : QLabel(&scene), seen_(std::move(seen)) {
    setAttribute(Qt::WA_NativeWindow);  // the scene is one too, and would be above
    setAlignment(Qt::AlignCenter);
    setStyleSheet("background: #20232b; color: #f5a623; font-size: 18px; font-weight: bold");
    cover(0);
    show();
    raise();
  }

  /// Covers the whole scene, whose size may have changed, and shows the elapsed time.
  void cover(double elapsed_s) {
    setGeometry(parentWidget()->contentsRect());
    const QString text = "Drawing the first picture\u2026";
    setText(elapsed_s < kSoon_s ? text : text + QString(" %1 s").arg(int(elapsed_s)));
  }

  /// Shrinks to its text: the X server discards what is drawn behind a window.
  void open() {
    QRect words(QPoint(), sizeHint());
    words.moveCenter(parentWidget()->contentsRect().center());
    setGeometry(words);
  }

 protected:
  void paintEvent(QPaintEvent* event) override {
    QLabel::paintEvent(event);
    if (!seen_) return;
    QTimer::singleShot(0, this, std::exchange(seen_, nullptr));
  }

 private:
  std::function<void()> seen_;
};

namespace {

constexpr std::uint64_t kFirstFrames = 2;  ///< with the models, and with messages that waited
constexpr std::uint64_t kOpenFrames = 2;
constexpr int kSettled_ms = 1000;  ///< for which RViz itself ignores changes by its panels

QMainWindow* mainWindow(rviz::DisplayContext& context) {
  rviz::WindowManagerInterface* manager = context.getWindowManager();
  QWidget* parent = manager ? manager->getParentWindow() : nullptr;
  return parent ? qobject_cast<QMainWindow*>(parent->window()) : nullptr;
}

/// Shows or hides the window. Signals of its panels are blocked: RViz would disable the displays of
/// panels that disappear, and save that.
void setVisible(QMainWindow& window, bool visible) {
  std::vector<QSignalBlocker> blockers;
  for (QDockWidget* panel : window.findChildren<QDockWidget*>()) blockers.emplace_back(panel);
  window.setVisible(visible);
}

}  // namespace

ReplayWindow::ReplayWindow(rviz::DisplayContext& context, std::function<void()> shown)
    : window_(mainWindow(context)),
      manager_(dynamic_cast<rviz::VisualizationManager*>(&context)),
      shown_(std::move(shown)) {
  if (!window_) return;
  is_open_ = window_->isVisible();
  window_->setAttribute(Qt::WA_ShowWithoutActivating);
  // Qt reads this attribute only when it creates the native window, which RViz may have done
  // before.
  if (window_->windowHandle())
    window_->windowHandle()->setProperty("_q_showWithoutActivating", true);
  window_->installEventFilter(this);
}

bool ReplayWindow::isShown() const { return window_ && window_->isVisible(); }

void ReplayWindow::keepUnmodified() {
  QMainWindow* const window = window_;
  if (!window || window->isWindowModified()) return;
  QTimer::singleShot(kSettled_ms, window, [window] { window->setWindowModified(false); });
}

void ReplayWindow::setBeginsHidden(bool begins_hidden) {
  if (!is_told_) begins_hidden_ = begins_hidden;
}

void ReplayWindow::show() {
  is_told_ = true;
  begins_hidden_ = false;
  if (!window_ || !manager_ || !is_open_) return;
  keepUnmodified();
  if (window_->isMinimized()) window_->setWindowState(Qt::WindowNoState);
  if (!has_picture_ && !curtain_ && window_->centralWidget()) {
    awaiting_.start();
    frames_before_ = manager_->getFrameCount();
    curtain_ = new ReplayCurtain(*window_->centralWidget(), [this] { draw(); });
  }
  if (!isShown()) setVisible(*window_, true);
  window_->raise();
  if (!curtain_) draw();
}

void ReplayWindow::draw() {
  if (manager_ && isShown()) manager_->startUpdate();
}

void ReplayWindow::awaitPicture() {
  if (!curtain_ || !manager_) return;
  const std::uint64_t frames = manager_->getFrameCount() - frames_before_;
  if (frames < kFirstFrames) {
    curtain_->cover(1e-3 * double(awaiting_.elapsed()));
  } else if (frames < kFirstFrames + kOpenFrames) {
    curtain_->open();
  } else {
    has_picture_ = true;
    delete curtain_.data();
  }
}

void ReplayWindow::hide() {
  is_told_ = true;
  if (!is_open_) begins_hidden_ = true;
  if (!window_ || !manager_ || !is_open_) return;
  manager_->stopUpdate();
  delete curtain_.data();
  keepUnmodified();
  setVisible(*window_, false);
}

void ReplayWindow::endWithRos() {
  if (window_ && !isShown() && !ros::ok()) QCoreApplication::quit();
}

bool ReplayWindow::eventFilter(QObject* object, QEvent* event) {
  if (object == window_ && event->type() == QEvent::Show && !event->spontaneous()) {
    is_open_ = true;
    shown_();
    if (begins_hidden_) beginHidden();
  }
  return QObject::eventFilter(object, event);
}

/// Called before the window is on the screen, so that it does not flash up.
void ReplayWindow::beginHidden() {
  window_->setAttribute(Qt::WA_DontShowOnScreen);
  QTimer::singleShot(0, this, [this] {
    const bool is_wanted = !begins_hidden_;  // show() was called meanwhile
    begins_hidden_ = false;
    hide();
    if (window_) window_->setAttribute(Qt::WA_DontShowOnScreen, false);
    if (is_wanted) show();
  });
}

}  // namespace process_visualizer::displays
