// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <QColor>
#include <QString>
#include <QWidget>

namespace process_visualizer::displays {

extern const QColor kReplayColor;

/// The band's picture: the word REPLAY on a plate, a text, and at the right what leads back. Drawn
/// by itself: a label would lay out RViz's window whenever its text changes.
class ReplayRibbon : public QWidget {
 public:
  explicit ReplayRibbon(QWidget* parent);

  void setText(const QString& text);

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  QString text_;
};

}  // namespace process_visualizer::displays
