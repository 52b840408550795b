// SPDX-License-Identifier: BSD-3-Clause
// Colors, contrast and font size of a plate, and painting it with Qt.

#include "label_plate.hpp"

#include <QFont>
#include <QFontMetrics>
#include <QGuiApplication>
#include <QPainter>
#include <algorithm>
#include <cmath>

namespace process_visualizer::displays {
namespace {

constexpr PlateStyle kDarkPlate{{0.07F, 0.08F, 0.10F}, {1, 1, 1}, 0.8F};
constexpr PlateStyle kLightPlate{{0.96F, 0.96F, 0.97F}, {0, 0, 0}, 0.85F};
constexpr float kMiddleLuminance = 0.18F;  ///< equal contrast to white and black
constexpr int kSteps = 20;

constexpr float kMinSize = 13, kMaxSize = 22;
constexpr float kUnchanged = 16;  ///< height in the picture that a text keeps on its plate, px
constexpr float kMinChange = 0.8F;

float linear(float part) {
  return part <= 0.04045F ? part / 12.92F : std::pow((part + 0.055F) / 1.055F, 2.4F);
}

float luminance(const Rgb& color) {
  return 0.2126F * linear(color.red) + 0.7152F * linear(color.green) + 0.0722F * linear(color.blue);
}

Rgb mixed(const Rgb& one, const Rgb& other, float part_of_other) {
  const auto mix = [&](float a, float b) { return a + part_of_other * (b - a); };
  return {mix(one.red, other.red), mix(one.green, other.green), mix(one.blue, other.blue)};
}

}  // namespace

float contrast(const Rgb& one, const Rgb& other) {
  const float a = luminance(one) + 0.05F, b = luminance(other) + 0.05F;
  return std::max(a, b) / std::min(a, b);
}

PlateStyle plateFor(const std::vector<Rgb>& texts) {
  float sum = 0;
  for (const Rgb& text : texts) sum += luminance(text);
  return sum >= kMiddleLuminance * static_cast<float>(texts.size()) ? kDarkPlate : kLightPlate;
}

Rgb worstBackground(const PlateStyle& plate) {
  return mixed(plate.behind, plate.color, plate.opacity);
}

Rgb readableOn(const PlateStyle& plate, Rgb text) {
  const Rgb background = worstBackground(plate);
  for (int i = 0; i <= kSteps; ++i) {
    const Rgb color = mixed(text, plate.behind, static_cast<float>(i) / kSteps);
    if (contrast(color, background) >= kReadableContrast) return color;
  }
  return plate.behind;
}

int fontSize(float projected, float pixel_ratio, int last) {
  const float height = std::sqrt(std::max(projected / pixel_ratio, 0.0F) * kUnchanged);
  const float size = pixel_ratio * std::clamp(height, kMinSize, kMaxSize);
  const bool hardly_changes = std::abs(size - static_cast<float>(last)) < kMinChange;
  return hardly_changes ? last : static_cast<int>(std::lround(size));
}

namespace {

constexpr int kMaxCharacters = 160;  ///< characters
constexpr int kMaxWidth = 1200;      ///< px
constexpr qreal kCorner = 0.4;       ///< radius relative to the text's size

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
    texts.append(QString::fromStdString(line.text).left(kMaxCharacters).simplified());
  return texts;
}

/// The width of a plate, in steps of the text's size.
int plateWidth(const QStringList& texts, const QFontMetrics& metrics, int step) {
  int width = 0;
  for (const QString& text : texts)
    width = std::max(width, metrics.boundingRect(text).width() + metrics.averageCharWidth() / 2);
  return std::min((width + step - 1) / step * step, kMaxWidth);
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
