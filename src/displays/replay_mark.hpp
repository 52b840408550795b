// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <QMargins>
#include <QObject>
#include <QPointer>
#include <QString>

class QMainWindow;
class QToolBar;

namespace process_visualizer::displays {

class ReplayRibbon;

/// What makes RViz's window one that nobody takes for the live one, for as long as this exists: a
/// band across its top, and a frame of the same colour around the scene.
class ReplayMark : public QObject {
 public:
  explicit ReplayMark(QMainWindow& window);
  ~ReplayMark() override;

  /// What stands beside the word REPLAY.
  void setText(const QString& text);

  /// Paints the frame.
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  void addBand(QMainWindow& window);
  void addFrame(QWidget& scene);
  void paintFrame();

  QPointer<QToolBar> band_;
  QPointer<QWidget> framed_;
  QMargins former_margins_;
  ReplayRibbon* ribbon_ = nullptr;  ///< belongs to the band
};

}  // namespace process_visualizer::displays
