// SPDX-License-Identifier: BSD-3-Clause
#include "replay_curtain.hpp"

#include <QTimer>
#include <utility>

namespace process_visualizer::displays {
namespace {

constexpr double kSoon_s = 1;  ///< until then nobody wants a number

}  // namespace

ReplayCurtain::ReplayCurtain(QWidget& scene, std::function<void()> seen)
    : QLabel(&scene), seen_(std::move(seen)) {
  setAttribute(Qt::WA_NativeWindow);  // the scene is one, and would lie above
  setAlignment(Qt::AlignCenter);
  setStyleSheet("background: #20232b; color: #f5a623; font-size: 18px; font-weight: bold");
  cover(0);
  show();
  raise();
}

void ReplayCurtain::cover(double elapsed_s) {
  setGeometry(parentWidget()->contentsRect());
  const QString text = "Drawing the first picture\u2026";
  setText(elapsed_s < kSoon_s ? text : text + QString(" %1 s").arg(int(elapsed_s)));
}

void ReplayCurtain::open() {
  QRect words(QPoint(), sizeHint());
  words.moveCenter(parentWidget()->contentsRect().center());
  setGeometry(words);
}

void ReplayCurtain::paintEvent(QPaintEvent* event) {
  QLabel::paintEvent(event);
  if (!seen_) return;
  QTimer::singleShot(0, this, std::exchange(seen_, nullptr));
}

}  // namespace process_visualizer::displays
