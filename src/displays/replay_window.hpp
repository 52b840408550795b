// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// RViz's main window during a replay: shown or hidden, without taking the keyboard focus.

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

/// RViz's main window, to show and hide. While it is hidden, RViz neither draws nor handles
/// messages or services. Does nothing if RViz has no window of its own.
class ReplayWindow : public QObject {
 public:
  /// `shown` is called whenever the window is about to appear, including the first time.
  ReplayWindow(rviz::DisplayContext& context, std::function<void()> shown);

  QMainWindow* window() const { return window_; }
  bool isShown() const;

  /// Shows it above all others, without taking the keyboard focus. Before RViz has opened the
  /// window, this and hide() set its first state.
  void show();
  void hide();
  /// Sets whether it stays hidden when RViz opens it, unless show() or hide() has been called.
  void setBeginsHidden(bool begins_hidden);
  /// Keeps RViz from asking to save the view because of changes in the next second, which are not
  /// the operator's.
  void keepUnmodified();
  /// Ends RViz with ROS: RViz exits when its window is closed, but a hidden one cannot be closed.
  void endWithRos();
  /// Shows a waiting message until the first picture is drawn; to be called often.
  void awaitPicture();

  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  void beginHidden();
  void draw();

  QPointer<QMainWindow> window_;
  QPointer<ReplayCurtain> curtain_;  ///< until the first picture is drawn
  QElapsedTimer awaiting_;
  std::uint64_t frames_before_ = 0;
  bool has_picture_ = false;
  QPointer<rviz::VisualizationManager> manager_;
  std::function<void()> shown_;
  bool is_open_ = false;  ///< RViz has opened it, even if hidden
  bool is_told_ = false;  ///< by show() or hide()
  bool begins_hidden_ = false;
};

}  // namespace process_visualizer::displays
