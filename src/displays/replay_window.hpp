// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <QElapsedTimer>
#include <QObject>
#include <QPointer>
#include <cstdint>
#include <functional>

class QMainWindow;

namespace rviz {
class DisplayContext;
class VisualizationManager;
}  // namespace rviz

namespace process_visualizer::displays {

class ReplayCurtain;

/// RViz's main window, shown and hidden. RViz neither draws nor looks for messages while it is
/// hidden, so nobody answers its services then. Does nothing if RViz has no window of its own.
class ReplayWindow : public QObject {
 public:
  /// `shown` is called whenever the window is about to appear, also for the first time.
  ReplayWindow(rviz::DisplayContext& context, std::function<void()> shown);

  QMainWindow* window() const { return window_; }
  bool isShown() const;

  /// Above all others, but without taking the keyboard. Before RViz has opened the window, this and
  /// hide() say how it begins.
  void show();
  void hide();
  /// Chooses whether it stays hidden when RViz opens it, unless show() or hide() was called since.
  void setBeginsHidden(bool begins_hidden);
  /// Nobody has changed a view by looking at it: what happens in the next second does not make RViz
  /// ask whether to save it.
  void keepUnmodified();
  /// RViz ends when its windows are closed, which does not happen to a hidden one.
  void endWithRos();
  /// To be called often: until the first picture is there, the window says that it is awaited.
  void awaitPicture();

  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  void beginHidden();
  void draw();

  QPointer<QMainWindow> window_;
  QPointer<ReplayCurtain> curtain_;  ///< until it has been drawn for the first time
  QElapsedTimer awaiting_;
  std::uint64_t frames_before_ = 0;
  bool has_picture_ = false;
  QPointer<rviz::VisualizationManager> manager_;
  std::function<void()> shown_;
  bool is_open_ = false;  ///< RViz has opened it, even if it is hidden
  bool is_told_ = false;  ///< by show() or hide()
  bool begins_hidden_ = false;
};

}  // namespace process_visualizer::displays
