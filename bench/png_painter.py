# SPDX-License-Identifier: BSD-3-Clause
"""Pictures with plots: a painter on a white .png file, and texts on it."""
from __future__ import annotations

import os
from contextlib import contextmanager
from typing import Iterator

from PyQt5.QtCore import QRectF, Qt
from PyQt5.QtGui import QColor, QFont, QGuiApplication, QImage, QPainter

TEXT_COLOR, GRID_COLOR = QColor('#333333'), QColor('#d5d5d5')


@contextmanager
def png_painter(path: str, width: int, height: int) -> Iterator[QPainter]:
    """Paint on white; the file is written at the end, with at most 256 colors."""
    os.environ.setdefault('QT_QPA_PLATFORM', 'offscreen')
    application = QGuiApplication.instance() or QGuiApplication([])
    image = QImage(width, height, QImage.Format_RGB32)
    image.fill(Qt.white)
    painter = QPainter(image)
    painter.setRenderHint(QPainter.Antialiasing)
    try:
        yield painter
    finally:
        painter.end()
    if not image.convertToFormat(QImage.Format_Indexed8, Qt.ThresholdDither).save(path):
        raise OSError(f'{path} cannot be written')
    del application


def draw_text(painter: QPainter, rect: QRectF, text: str, points: int,
              color: QColor = TEXT_COLOR, bold: bool = False, align: int = Qt.AlignLeft,
              wrap: bool = False) -> None:
    """Write in a rectangle, centered vertically."""
    font = QFont('DejaVu Sans', points)
    font.setBold(bold)
    painter.setFont(font)
    painter.setPen(color)
    flags = align | Qt.AlignVCenter | (Qt.TextWordWrap if wrap else 0)
    painter.drawText(rect, int(flags), text)
