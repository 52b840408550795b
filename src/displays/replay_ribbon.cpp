// SPDX-License-Identifier: BSD-3-Clause
#include "replay_ribbon.hpp"

#include <QFontMetrics>
#include <QPainter>

namespace process_visualizer::displays {

const QColor kReplayColor(0xf5, 0xa6, 0x23);

namespace {

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

/// Draws the word on its plate at the left; returns where the plate ends.
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

/// Draws a text from `left` on; returns where it ends.
int drawText(const QString& text, int left, const QRect& band, QPainter& painter) {
  painter.setPen(Qt::black);
  painter.drawText(band.adjusted(left, 0, 0, 0), Qt::AlignLeft | Qt::AlignVCenter, text);
  return left + widthOf(text, painter);
}

}  // namespace

ReplayRibbon::ReplayRibbon(QWidget* parent) : QWidget(parent) {
  setFixedHeight(kHeight);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  setAttribute(Qt::WA_OpaquePaintEvent);
}

void ReplayRibbon::setText(const QString& text) {
  if (text == text_) return;
  text_ = text;
  update();
}

void ReplayRibbon::paintEvent(QPaintEvent* /*event*/) {
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

}  // namespace process_visualizer::displays
