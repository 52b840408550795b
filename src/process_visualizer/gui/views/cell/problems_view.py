# SPDX-License-Identifier: BSD-3-Clause
"""The problems of a configuration; a click on one opens the file there."""
from __future__ import annotations

import os
from typing import Optional, Sequence

from PyQt5.QtCore import QRectF, QSize, Qt, pyqtSignal
from PyQt5.QtGui import QGuiApplication, QPainter, QPalette, QTextDocument
from PyQt5.QtWidgets import (
    QLabel,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QSizePolicy,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QWidget,
)

from process_visualizer.cell.errors import Problem
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.toolkit.theme_following import ThemeFollower, set_sheet
from process_visualizer.gui.views.parts.layouts import in_column, in_row
from process_visualizer.health.figures import count_text

_ICON_PX = 18
_MARGIN_PX = 6


class ProblemsView(QWidget):
    """A list with a line for each problem, and a button that copies all."""

    open_wanted = pyqtSignal(str, int)
    """The operator wants to see this file at this line (from 1)."""

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._problems: Sequence[Problem] = ()
        self._icon = QLabel()
        self._draw_icon()
        ThemeFollower(self, self._draw_icon)
        self._title = QLabel()
        self._title.setObjectName('problems_title')
        self._copy = QPushButton('Copy all')
        self._copy.setObjectName('copy_problems')
        self._copy.setToolTip('Copy all problems as text')
        self._copy.clicked.connect(
            lambda: QGuiApplication.clipboard().setText('\n'.join(map(str, self._problems))))
        self._list = _list()
        self._list.itemClicked.connect(self._open)
        self._list.itemActivated.connect(self._open)
        header = in_row(self._icon, self._title, self._copy, wide=self._title)
        in_column(self, 6, header, self._list)
        self.setSizePolicy(QSizePolicy.Preferred, QSizePolicy.Ignored)

    def set_problems(self, problems: Sequence[Problem]) -> None:
        """Show these problems."""
        if list(problems) == list(self._problems):
            return
        self._problems = problems
        self._title.setText(f'<b>{count_text(len(problems), "problem")}</b> in the configuration')
        self._list.clear()
        for problem in problems:
            item = QListWidgetItem(str(problem))
            item.setData(Qt.UserRole, problem)
            item.setToolTip(f'{problem.location}\nClick to open the file there')
            self._list.addItem(item)

    def _draw_icon(self) -> None:
        self._icon.setPixmap(icon('warning').pixmap(QSize(_ICON_PX, _ICON_PX)))

    def _open(self, item: QListWidgetItem) -> None:
        problem = item.data(Qt.UserRole)
        self.open_wanted.emit(problem.location.file, problem.location.line)


def problem_html(problem: Problem) -> str:
    """Return a problem with its place in front, like a link, and its element."""
    place = f'{os.path.basename(problem.location.file)}:{problem.location.line}'
    element = f'<span style="color:{theme().quiet}">&lt;{_escaped(problem.element)}&gt;</span> ' \
        if problem.element else ''
    return (f'<span style="color:{theme().accent}"><b>{_escaped(place)}</b></span> {element}<br>'
            f'{_escaped(problem.message)}')


def _escaped(text: str) -> str:
    return text.replace('&', '&amp;').replace('<', '&lt;').replace('>', '&gt;')


class _ProblemDelegate(QStyledItemDelegate):
    """Draws a problem over as many lines as it needs."""

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: object) -> None:
        area = QRectF(option.rect)
        if option.state & (QStyle.State_MouseOver | QStyle.State_Selected):
            painter.fillRect(area, option.palette.brush(QPalette.Midlight))
        painter.save()
        painter.setPen(Qt.NoPen)
        painter.fillRect(QRectF(area.left(), area.bottom() - 1, area.width(), 1),
                         option.palette.brush(QPalette.Midlight))
        painter.translate(area.topLeft())
        self._document(option, index).drawContents(painter)
        painter.restore()

    def sizeHint(self, option: QStyleOptionViewItem, index: object) -> QSize:
        document = self._document(option, index)
        return QSize(int(document.idealWidth()), int(document.size().height()))

    def _width(self) -> int:
        """The width beside the scroll bar, whether that is shown or not."""
        problems = self.parent()
        return int(problems.width() - 2 * problems.frameWidth()
                   - problems.verticalScrollBar().sizeHint().width())

    def _document(self, option: QStyleOptionViewItem, index: object) -> QTextDocument:
        document = QTextDocument()
        document.setDocumentMargin(_MARGIN_PX)
        document.setDefaultFont(option.font)
        document.setTextWidth(self._width())
        document.setHtml(problem_html(index.data(Qt.UserRole)))  # type: ignore[attr-defined]
        return document


def _list() -> QListWidget:
    problems = QListWidget()
    problems.setObjectName('problems')
    problems.setAccessibleName('Problems')
    problems.setItemDelegate(_ProblemDelegate(problems))
    problems.setMouseTracking(True)
    problems.viewport().setCursor(Qt.PointingHandCursor)
    problems.setHorizontalScrollBarPolicy(Qt.ScrollBarAlwaysOff)
    problems.setVerticalScrollMode(QListWidget.ScrollPerPixel)
    problems.setResizeMode(QListWidget.Adjust)
    set_sheet(problems, 'QListWidget { border: 1px solid <line>; border-radius: 3px; }')
    return problems
