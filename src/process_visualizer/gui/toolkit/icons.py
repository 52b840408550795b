# SPDX-License-Identifier: BSD-3-Clause
"""The launcher's icons, drawn as paths and so crisp at every size and scale."""
from __future__ import annotations

import functools
from typing import Callable, Dict, NamedTuple, Tuple

from PyQt5.QtCore import QPointF, QRect, QRectF, QSize, Qt
from PyQt5.QtGui import QColor, QIcon, QIconEngine, QPainter, QPainterPath, QPen, QPixmap, QPolygonF

from process_visualizer.gui.toolkit.theme import theme

# The shapes of the icons, on a grid of 24 by 24.

GRID = 24.0
STROKE = 1.8

Point = Tuple[float, float]


class Shape(NamedTuple):
    """The filled parts, and the stroked lines."""

    filled: QPainterPath
    lines: QPainterPath


@functools.lru_cache(maxsize=None)
def shape(name: str) -> Shape:
    """Return the shape of an icon.

    Raises:
        KeyError: there is no icon of this name.
    """
    return _SHAPES[name]()


def names() -> Tuple[str, ...]:
    """Return the names of all icons."""
    return tuple(_SHAPES)


def _path(*parts: QPainterPath) -> QPainterPath:
    path = QPainterPath()
    path.setFillRule(Qt.WindingFill)
    for part in parts:
        path.addPath(part)
    return path


def _filled(*parts: QPainterPath) -> Shape:
    return Shape(_path(*parts), QPainterPath())


def _lines(*parts: QPainterPath) -> Shape:
    return Shape(QPainterPath(), _path(*parts))


def _polygon(*points: Point) -> QPainterPath:
    path = QPainterPath()
    path.addPolygon(QPolygonF([QPointF(*point) for point in points]))
    path.closeSubpath()
    return path


def _line(*points: Point) -> QPainterPath:
    path = QPainterPath(QPointF(*points[0]))
    for point in points[1:]:
        path.lineTo(*point)
    return path


def _box(x: float, y: float, width: float, height: float, radius: float = 0.8) -> QPainterPath:
    path = QPainterPath()
    path.addRoundedRect(QRectF(x, y, width, height), radius, radius)
    return path


def _circle(x: float, y: float, radius: float) -> QPainterPath:
    path = QPainterPath()
    path.addEllipse(QPointF(x, y), radius, radius)
    return path


def _arc(x: float, y: float, radius: float, start_deg: float, sweep_deg: float) -> QPainterPath:
    """A part of a circle; angles counter-clockwise from three o'clock."""
    rect = QRectF(x - radius, y - radius, 2 * radius, 2 * radius)
    path = QPainterPath()
    path.arcMoveTo(rect, start_deg)
    path.arcTo(rect, start_deg, sweep_deg)
    return path


def _play() -> Shape:
    return _filled(_polygon((7, 4.5), (19.5, 12), (7, 19.5)))


def _play_backwards() -> Shape:
    return _filled(_polygon((17, 4.5), (4.5, 12), (17, 19.5)))


def _pause() -> Shape:
    return _filled(_box(6, 5, 4.2, 14), _box(13.8, 5, 4.2, 14))


def _stop() -> Shape:
    return _filled(_box(5.5, 5.5, 13, 13, 1.2))


def _to_start() -> Shape:
    return _filled(_box(4, 5.5, 2.4, 13, 0.6), _polygon((13.4, 5.5), (7, 12), (13.4, 18.5)),
                   _polygon((20, 5.5), (13.6, 12), (20, 18.5)))


def _to_end() -> Shape:
    return _filled(_box(17.6, 5.5, 2.4, 13, 0.6), _polygon((10.6, 5.5), (17, 12), (10.6, 18.5)),
                   _polygon((4, 5.5), (10.4, 12), (4, 18.5)))


def _step_back() -> Shape:
    return _filled(_polygon((14, 5.5), (4.5, 12), (14, 18.5)), _box(16.4, 5.5, 3, 13, 0.6))


def _step_forward() -> Shape:
    return _filled(_polygon((10, 5.5), (19.5, 12), (10, 18.5)), _box(4.6, 5.5, 3, 13, 0.6))


def _loop() -> Shape:
    lines = _path(_line((4.5, 11), (4.5, 9.5)), _line((19.5, 13), (19.5, 14.5)),
                  _corner(4.5, 9.5, 7.5, 6.5), _line((7.5, 6.5), (17, 6.5)),
                  _corner(19.5, 14.5, 16.5, 17.5), _line((16.5, 17.5), (7, 17.5)))
    return Shape(_path(_polygon((16, 2.8), (20.6, 6.5), (16, 10.2)),
                       _polygon((8, 13.8), (3.4, 17.5), (8, 21.2))), lines)


def _corner(x: float, y: float, to_x: float, to_y: float) -> QPainterPath:
    path = QPainterPath(QPointF(x, y))
    path.quadTo(x, to_y, to_x, to_y)
    return path


def _loop_begin() -> Shape:
    letter = _line((9, 18), (13.5, 6), (18, 18))
    return _lines(_line((4.5, 4.5), (4.5, 19.5)), letter, _line((10.6, 14), (16.4, 14)))


def _loop_end() -> Shape:
    bows = QPainterPath(QPointF(6, 6))
    for top, bottom in ((6.0, 12.0), (12.0, 18.0)):
        bows.moveTo(6.5, top)
        bows.lineTo(10.5, top)
        bows.cubicTo(15.5, top, 15.5, bottom, 10.5, bottom)
        bows.lineTo(6.5, bottom)
    return _lines(_line((6.5, 6), (6.5, 18)), bows, _line((19.5, 4.5), (19.5, 19.5)))


def _mark() -> Shape:
    return Shape(_polygon((6, 4), (19, 8.2), (6, 12.8)), _line((6, 4), (6, 20.5)))


def _record() -> Shape:
    return _filled(_circle(12, 12, 6.8))


def _restart() -> Shape:
    return Shape(_polygon((11.8, 1.6), (11.8, 8.8), (17.4, 5.2)), _arc(12, 12.6, 7.4, 95, 290))


def _reload() -> Shape:
    return Shape(_path(_polygon((20.4, 4.2), (20.4, 10.6), (14.4, 9.4)),
                       _polygon((3.6, 19.8), (3.6, 13.4), (9.6, 14.6))),
                 _path(_arc(12, 12, 7.4, 30, 130), _arc(12, 12, 7.4, 210, 130)))


def _folder() -> Shape:
    return _lines(_polygon((3.5, 6), (9.5, 6), (11.5, 8.5), (20.5, 8.5), (20.5, 18.5), (3.5, 18.5)))


def _open() -> Shape:
    return _lines(_line((18, 10.5), (18, 8), (11.5, 8), (9.5, 5.5), (3.5, 5.5), (3.5, 18.5)),
                  _polygon((3.5, 18.5), (6.5, 10.8), (21.5, 10.8), (18.2, 18.5)))


def _new() -> Shape:
    """A sheet of paper with a plus."""
    return _lines(_polygon((5, 3.5), (13.5, 3.5), (19, 9), (19, 20.5), (5, 20.5)),
                  _line((12, 10.5), (12, 17.5)), _line((8.5, 14), (15.5, 14)))


def _view() -> Shape:
    """A cube, as RViz shows things in space."""
    return _lines(_polygon((12, 3), (20, 7.5), (20, 16.5), (12, 21), (4, 16.5), (4, 7.5)),
                  _line((4, 7.5), (12, 12), (20, 7.5)), _line((12, 12), (12, 21)))


def _fit() -> Shape:
    """A point in the middle of cross hairs."""
    return Shape(_circle(12, 12, 2.2), _path(
        _circle(12, 12, 6.5), _line((12, 2), (12, 7)), _line((12, 17), (12, 22)),
        _line((2, 12), (7, 12)), _line((17, 12), (22, 12))))


def _save() -> Shape:
    return _lines(_polygon((4, 4), (16.5, 4), (20, 7.5), (20, 20), (4, 20)),
                  _line((8, 4), (8, 8.5), (15, 8.5), (15, 4)),
                  _line((7.5, 20), (7.5, 13.5), (16.5, 13.5), (16.5, 20)))


def _revert() -> Shape:
    return Shape(_polygon((9.5, 3.2), (3.2, 8), (9.5, 12.8)),
                 _path(_line((8, 8), (14, 8)), _arc(14, 13.2, 5.2, 90, -180),
                       _line((14, 18.4), (7, 18.4))))


def _list() -> Shape:
    rows = (6.0, 12.0, 18.0)
    return Shape(_path(*(_circle(4.5, y, 1.2) for y in rows)),
                 _path(*(_line((9, y), (20, y)) for y in rows)))


def _theme() -> Shape:
    half = _arc(12, 12, 7.5, 90, -180)
    half.closeSubpath()
    return Shape(half, _circle(12, 12, 7.5))


def _help() -> Shape:
    hook = QPainterPath(QPointF(9.2, 9.6))
    hook.cubicTo(9.2, 5.4, 15, 5.6, 15, 9.2)
    hook.cubicTo(15, 11.6, 12, 11.6, 12, 14)
    return Shape(_circle(12, 17.2, 1.2), _path(_circle(12, 12, 9), hook))


def _warning() -> Shape:
    return Shape(_circle(12, 17, 1.15), _path(_polygon((12, 3.5), (21.5, 20.2), (2.5, 20.2)),
                                              _line((12, 9.5), (12, 13.8))))


def _ok() -> Shape:
    return _lines(_circle(12, 12, 9), _line((7.6, 12.4), (10.8, 15.6), (16.6, 9)))


def _died() -> Shape:
    return _lines(_circle(12, 12, 9), _line((8.6, 8.6), (15.4, 15.4)),
                  _line((15.4, 8.6), (8.6, 15.4)))


def _waiting() -> Shape:
    return _lines(_circle(12, 12, 9), _line((12, 6.8), (12, 12), (15.6, 14.4)))


_SHAPES: Dict[str, Callable[[], Shape]] = {
    'play': _play, 'pause': _pause, 'stop': _stop, 'to_start': _to_start, 'to_end': _to_end,
    'step_back': _step_back, 'step_forward': _step_forward, 'play_backwards': _play_backwards,
    'loop': _loop, 'loop_begin': _loop_begin, 'loop_end': _loop_end, 'mark': _mark,
    'record': _record, 'restart': _restart, 'reload': _reload, 'folder': _folder, 'open': _open,
    'new': _new, 'view': _view, 'fit': _fit, 'save': _save, 'revert': _revert, 'help': _help,
    'theme': _theme,
    'list': _list,
    'warning': _warning, 'ok': _ok, 'died': _died, 'waiting': _waiting,
}


_SIGNALS: Dict[str, str] = {'record': 'bad', 'died': 'bad', 'warning': 'warning', 'ok': 'good',
                            'waiting': 'waiting'}


def icon(name: str) -> QIcon:
    """Return an icon by its name; grey when disabled, in the accent colour when checked.

    Icons whose colour has a meaning (record, warning, ok, …) keep it when checked.

    Raises:
        KeyError: there is no icon of this name.
    """
    signal = _SIGNALS.get(name)
    return QIcon(_Engine(shape(name), signal or 'shape', signal or 'accent'))


class _Engine(QIconEngine):
    """Draws a shape in any size, in colours of the theme (names of its fields)."""

    def __init__(self, drawn: Shape, colour: str, checked: str) -> None:
        super().__init__()
        self._shape = drawn
        self._colour = colour
        self._checked = checked

    def clone(self) -> QIconEngine:
        return _Engine(self._shape, self._colour, self._checked)

    def pixmap(self, size: QSize, mode: QIcon.Mode, state: QIcon.State) -> QPixmap:
        pixmap = QPixmap(size)
        pixmap.fill(Qt.transparent)
        painter = QPainter(pixmap)
        self.paint(painter, QRect(0, 0, size.width(), size.height()), mode, state)
        painter.end()
        return pixmap

    def paint(self, painter: QPainter, rect: QRect, mode: QIcon.Mode, state: QIcon.State) -> None:
        side = min(rect.width(), rect.height())
        colour = self._colour_in(mode, state)
        painter.save()
        painter.setRenderHint(QPainter.Antialiasing)
        painter.translate(rect.x() + (rect.width() - side) / 2,
                          rect.y() + (rect.height() - side) / 2)
        painter.scale(side / GRID, side / GRID)
        painter.fillPath(self._shape.filled, colour)
        painter.strokePath(self._shape.lines, QPen(colour, STROKE, Qt.SolidLine, Qt.RoundCap,
                                                   Qt.RoundJoin))
        painter.restore()

    def _colour_in(self, mode: QIcon.Mode, state: QIcon.State) -> QColor:
        if mode == QIcon.Disabled:
            return QColor(theme().disabled_shape)
        return QColor(getattr(theme(), self._checked if state == QIcon.On else self._colour))
