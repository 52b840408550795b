// SPDX-License-Identifier: BSD-3-Clause
#include "replay_mark.hpp"

#include <QEvent>
#include <QLayout>
#include <QMainWindow>
#include <QPainter>
#include <QToolBar>

#include "replay_ribbon.hpp"

namespace process_visualizer::displays {
namespace {

constexpr int kFrame = 4;  ///< width of the frame, px

/// The toolbar that is the first below the menu; nullptr without one.
QToolBar* firstOnTop(const QMainWindow& window) {
  for (QToolBar* bar : window.findChildren<QToolBar*>(QString(), Qt::FindDirectChildrenOnly)) {
    if (window.toolBarArea(bar) == Qt::TopToolBarArea) return bar;
  }
  return nullptr;
}

/// A band that nobody can move or switch off by the menu of toolbars.
QToolBar* makeBand(QMainWindow& window) {
  auto* band = new QToolBar("Replay", &window);
  band->setObjectName("replay_band");  // QMainWindow::saveState() warns of bars without a name
  band->setMovable(false);
  band->setFloatable(false);
  band->setContextMenuPolicy(Qt::PreventContextMenu);
  band->toggleViewAction()->setVisible(false);
  band->setContentsMargins(0, 0, 0, 0);
  band->layout()->setContentsMargins(0, 0, 0, 0);
  band->layout()->setSpacing(0);
  return band;
}

}  // namespace

ReplayMark::ReplayMark(QMainWindow& window) {
  addBand(window);
  if (window.centralWidget()) addFrame(*window.centralWidget());
}

ReplayMark::~ReplayMark() {
  delete band_.data();
  if (!framed_) return;
  framed_->removeEventFilter(this);
  framed_->setContentsMargins(former_margins_);
  framed_->update();
}

void ReplayMark::setText(const QString& text) {
  if (band_) ribbon_->setText(text);
}

bool ReplayMark::eventFilter(QObject* object, QEvent* event) {
  if (object == framed_ && event->type() == QEvent::Paint) paintFrame();
  return QObject::eventFilter(object, event);
}

void ReplayMark::paintFrame() {
  QPainter painter(framed_);
  painter.fillRect(framed_->rect(), kReplayColor);
  // Beside the scene are buttons without a background of their own.
  painter.fillRect(framed_->contentsRect(), framed_->palette().window());
}

void ReplayMark::addBand(QMainWindow& window) {
  QToolBar* const first = firstOnTop(window);
  band_ = makeBand(window);
  ribbon_ = new ReplayRibbon(band_);
  band_->addWidget(ribbon_);
  if (first) {
    window.insertToolBar(first, band_);
    window.insertToolBarBreak(first);
  } else {
    window.addToolBar(Qt::TopToolBarArea, band_);
  }
}

void ReplayMark::addFrame(QWidget& scene) {
  framed_ = &scene;
  former_margins_ = scene.contentsMargins();
  scene.setContentsMargins(kFrame, kFrame, kFrame, kFrame);
  // Not by a style sheet: all widgets inside would be drawn by another style.
  scene.installEventFilter(this);
  scene.update();
}

}  // namespace process_visualizer::displays
