// SPDX-License-Identifier: BSD-3-Clause
#include "plate_painter.hpp"

#include <QFont>
#include <QFontMetrics>
#include <QGuiApplication>
#include <QPainter>
#include <algorithm>
#include <cmath>

namespace process_visualizer::displays {
namespace {

constexpr int kLongestLine = 160;  ///< characters
constexpr int kWidest = 1200;      ///< px
constexpr qreal kCorner = 0.4;     ///< its radius, as a part of the text's size

QColor qColor(const Rgb& color, float opacity = 1) {
  return QColor::fromRgbF(color.red, color.green, color.blue, opacity);
}

QFont fontOf(int size_px) {
  QFont font = QGuiApplication::font();
  font.setPixelSize(size_px);
  font.setStyleStrategy(QFont::StyleStrategy(QFont::PreferAntialias | QFont::NoSubpixelAntialias));
  return font;
}

QStringList textsOf(const std::vector<PlateLine>& lines) {
  QStringList texts;
  for (const PlateLine& line : lines)
    texts.append(QString::fromStdString(line.text).left(kLongestLine).simplified());
  return texts;
}

/// In steps of the text's size.
int plateWidth(const QStringList& texts, const QFontMetrics& metrics, int step) {
  int width = 0;
  for (const QString& text : texts)
    width = std::max(width, metrics.boundingRect(text).width() + metrics.averageCharWidth() / 2);
  return std::min((width + step - 1) / step * step, kWidest);
}

PlateStyle styleOf(const std::vector<PlateLine>& lines) {
  std::vector<Rgb> colors;
  colors.reserve(lines.size());
  for (const PlateLine& line : lines) colors.push_back(line.color);
  return plateFor(colors);
}

void drawPlate(QPainter& painter, const QSize& size, const PlateStyle& style, qreal corner) {
  painter.setPen(qColor(style.behind, 0.25F));
  painter.setBrush(qColor(style.color, style.opacity));
  painter.drawRoundedRect(QRectF(0.5, 0.5, size.width() - 1, size.height() - 1), corner, corner);
}

}  // namespace

bool operator==(const PlateLine& one, const PlateLine& other) {
  return one.text == other.text && one.color.red == other.color.red &&
         one.color.green == other.color.green && one.color.blue == other.color.blue;
}

QImage paintPlate(const std::vector<PlateLine>& lines, int font_size_px) {
  const QFont font = fontOf(font_size_px);
  const QFontMetrics metrics(font);
  const QStringList texts = textsOf(lines);
  const int margin = (font_size_px + 1) / 2, step = metrics.height();
  QImage image(plateWidth(texts, metrics, font_size_px) + 2 * margin, step * texts.size() + margin,
               QImage::Format_ARGB32_Premultiplied);
  image.fill(Qt::transparent);
  QPainter painter(&image);
  painter.setRenderHint(QPainter::Antialiasing);
  const PlateStyle style = styleOf(lines);
  drawPlate(painter, image.size(), style, kCorner * font_size_px);
  painter.setFont(font);
  for (int i = 0; i < texts.size(); ++i) {
    painter.setPen(qColor(readableOn(style, lines[i].color)));
    painter.drawText(margin, margin / 2 + i * step + metrics.ascent(), texts[i]);
  }
  return image;
}

}  // namespace process_visualizer::displays
