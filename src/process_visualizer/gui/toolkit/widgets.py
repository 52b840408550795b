# SPDX-License-Identifier: BSD-3-Clause
"""Widgets that the panels share: labels that fit, notices, pose fields, guarded buttons."""
from __future__ import annotations

import math
from typing import Callable, List, Optional, TypeVar, Union

from PyQt5.QtCore import QEvent, QModelIndex, QObject, QRect, QSize, Qt, QTimer, pyqtSignal
from PyQt5.QtGui import (
    QColor,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPalette,
    QResizeEvent,
    QWheelEvent,
)
from PyQt5.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QApplication,
    QDoubleSpinBox,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLayout,
    QPushButton,
    QSizePolicy,
    QStatusBar,
    QStyle,
    QStyledItemDelegate,
    QStyleOption,
    QStyleOptionButton,
    QStyleOptionViewItem,
    QStylePainter,
    QTabWidget,
    QToolButton,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.cell.model import Pose
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.labels import plain_label, plain_tip
from process_visualizer.gui.toolkit.theme import (
    ThemeFollower,
    color,
    color_indicators,
    color_selection,
    set_sheet,
    theme,
)

_LabelType = TypeVar('_LabelType', bound=QLabel)


def small(label: _LabelType) -> _LabelType:
    """Return the label in a slightly smaller size."""
    font = label.font()
    font.setPointSizeF(font.pointSizeF() * 0.9)
    label.setFont(font)
    return label


def note(name: str) -> QLabel:
    """Return a quiet label of one or more lines, hidden until ``show_note`` gives it a text."""
    label = plain_label()
    label.setObjectName(name)
    label.setWordWrap(True)
    label.hide()
    color(label, 'quiet')
    return label


def show_note(label: QLabel, text: str) -> None:
    """Show a text; hide the label if the text is empty."""
    label.setText(text)
    label.setVisible(bool(text))


class WrappedLabel(QLabel):
    """Plain text that wraps before names such as /arm/joints rather than within them.

    Qt breaks lines after any slash, even after the first one of a name.
    """

    def __init__(self, name: str) -> None:
        """Set the object name."""
        super().__init__()
        self.setObjectName(name)
        self.setWordWrap(True)
        self.setTextFormat(Qt.PlainText)
        self.setTextInteractionFlags(Qt.TextSelectableByMouse)
        self._given = ''

    def text(self) -> str:
        """Return the text as it was set."""
        return self._given

    def setText(self, text: str) -> None:
        """Show a text."""
        self._given = text
        self._wrap()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Wrap the text for the new width."""
        super().resizeEvent(event)
        self._wrap()

    def _wrap(self) -> None:
        text = '\n'.join(map(self._wrapped, self._given.split('\n')))
        if text != super().text():
            super().setText(text)

    def _wrapped(self, text: str) -> str:
        """Return a paragraph with a line break before each name that does not fit into the line."""
        first, *words = text.split(' ')
        shown = line = first
        for word in words:
            longer = f'{line} {word}'
            fits = self.fontMetrics().horizontalAdvance(longer) <= self.contentsRect().width()
            shown += f'{" " if fits or "/" not in word else chr(10)}{word}'
            line = longer if fits else word
        return shown


def title(text: str) -> QLabel:
    """Return a bold label, for the head of a group."""
    label = plain_label(text)
    font = label.font()
    font.setBold(True)
    label.setFont(font)
    return label


def tool_button(name: str, icon_name: str, hint: str, action: Callable[[], object],
                text: Optional[str] = None) -> QToolButton:
    """Return a flat button with an icon."""
    button = QToolButton()
    button.setObjectName(name)
    button.setIcon(icon(icon_name))
    button.setToolTip(plain_tip(hint))
    button.setAccessibleName(hint.split(' (')[0])  # without the key
    button.setAutoRaise(True)
    if text is not None:
        button.setText(text)
    button.clicked.connect(lambda: action())
    return button


def in_column(parent: QWidget, spacing_px: int, *parts: Union[QWidget, QLayout]) -> QVBoxLayout:
    """Lay out a widget's parts one below the other, without margins."""
    layout = QVBoxLayout(parent)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(spacing_px)
    for part in parts:
        layout.addWidget(part) if isinstance(part, QWidget) else layout.addLayout(part)
    return layout


def in_row(*widgets: QWidget, wide: Optional[QWidget] = None) -> QHBoxLayout:
    """Return widgets side by side; the one that is ``wide`` gets the remaining room."""
    layout = QHBoxLayout()
    for widget in widgets:
        layout.addWidget(widget, int(widget is wide))
    return layout


_IMPATIENT_MS = 1000
_USES = (QEvent.MouseButtonPress, QEvent.MouseButtonDblClick, QEvent.MouseButtonRelease)
_USES_BY_KEY = (QEvent.KeyPress, QEvent.KeyRelease)
_KEYS = (Qt.Key_Space, Qt.Key_Select, Qt.Key_Return, Qt.Key_Enter)


class MeaningGuard(QObject):
    """Ignores mouse and keyboard on a button that had another meaning just before.

    So neither a double click nor an impatient second click undoes what the first one did.
    """

    def __init__(self, button: QAbstractButton) -> None:
        super().__init__(button)
        self._meaning = self._before = ''
        self._timer = QTimer(self, singleShot=True,
                             interval=QApplication.doubleClickInterval() + _IMPATIENT_MS)
        button.installEventFilter(self)

    @property
    def is_ignoring(self) -> bool:
        """Return whether the meaning is too new for a click to be meant for it."""
        return self._timer.isActive()

    def show(self, meaning: str) -> None:
        """Set what the button does now, such as "quit"; empty while it does nothing."""
        if meaning == self._meaning:
            return
        if self._meaning:
            self._before = self._meaning
            self._timer.start()
        if meaning == self._before:
            self._timer.stop()
        self._meaning = meaning

    def eventFilter(self, button: QObject, event: QEvent) -> bool:
        """Filter the events that would use the button while its meaning is new."""
        if not self.is_ignoring or not (event.type() in _USES or (
                event.type() in _USES_BY_KEY and event.key() in _KEYS)):
            return False
        if isinstance(button, QAbstractButton):
            button.setDown(False)  # it may have been pressed before the change
        return True


_MIN_PX, _PADDING_PX = 60, 12
_BAR_MARGIN_PX = 6


class ElidedButton(QPushButton):
    """Shows as much of its text as fits."""

    def sizeHint(self) -> QSize:
        """Return a minimal width."""
        return QSize(_MIN_PX, super().sizeHint().height())

    def minimumSizeHint(self) -> QSize:
        """Return a minimal width."""
        return self.sizeHint()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw as much as fits."""
        option = QStyleOptionButton()
        self.initStyleOption(option)
        option.text = self.fontMetrics().elidedText(
            self.text(), Qt.ElideRight, self.width() - _PADDING_PX)
        QStylePainter(self).drawControl(QStyle.CE_PushButton, option)


class ElidedLabel(QLabel):
    """Shows as much of a text as fits into one or more lines; the tooltip has the whole text."""

    def __init__(self, mode: Qt.TextElideMode = Qt.ElideMiddle,
                 parent: Optional[QWidget] = None, lines: int = 1) -> None:
        super().__init__(parent)
        self._mode, self._lines = mode, lines
        self.setTextFormat(Qt.PlainText)

    def setText(self, text: str) -> None:
        """Show a text."""
        if text != self.text():
            super().setText(text)
            self.setToolTip(plain_tip(text))

    def minimumSizeHint(self) -> QSize:
        """Return a minimal width."""
        return QSize(20, super().minimumSizeHint().height())

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw as much as fits."""
        painter = QPainter(self)
        area = self.contentsRect()
        self.style().drawItemText(painter, area, int(self.alignment()), self.palette(),
                                  self.isEnabled(), self.shown_text(area.width()),
                                  self.foregroundRole())

    def shown_text(self, width_px: int) -> str:
        """Return the part of the text that fits into a width, with line breaks."""
        words, metrics = self.text().split(' '), self.fontMetrics()
        shown: List[str] = []
        while len(shown) < self._lines - 1 and len(words) > 1:
            line = words.pop(0)
            while words and metrics.horizontalAdvance(f'{line} {words[0]}') <= width_px:
                line += f' {words.pop(0)}'
            shown.append(metrics.elidedText(line, self._mode, width_px))
        rest = metrics.elidedText(' '.join(words), self._mode, width_px)
        return '\n'.join([*shown, *filter(None, [rest])])


class MessageBar(QStatusBar):
    """A status bar that shows where its message is cut; a click asks for the whole message.

    The tooltip also has the whole message.
    """

    whole_wanted = pyqtSignal(str)
    """The operator wants to read this whole message, which is cut."""

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.messageChanged.connect(self._follow)

    @property
    def shown_text(self) -> str:
        """Return the part of the message that fits."""
        text = ' '.join(self.currentMessage().split())
        return self.fontMetrics().elidedText(text, Qt.ElideRight, self._room().width())

    @property
    def is_cut(self) -> bool:
        """Return whether there is more of the message than fits."""
        return self.shown_text != ' '.join(self.currentMessage().split())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fit the message into the new width."""
        super().resizeEvent(event)
        self._follow()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Ask for the whole message if it is cut."""
        super().mouseReleaseEvent(event)
        if event.button() == Qt.LeftButton and self.rect().contains(event.pos()) and self.is_cut:
            self.whole_wanted.emit(self.currentMessage())

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw as much of the message as fits."""
        option = QStyleOption()
        option.initFrom(self)
        painter = QStylePainter(self)
        painter.drawPrimitive(QStyle.PE_PanelStatusBar, option)
        painter.setPen(self.palette().color(self.foregroundRole()))
        painter.drawText(self._room(), int(Qt.AlignLeft | Qt.AlignVCenter | Qt.TextSingleLine),
                         self.shown_text)

    def _room(self) -> QRect:
        """Return the room for the message, beside the handle that resizes the window."""
        grip_px = self.style().pixelMetric(QStyle.PM_ScrollBarExtent)
        return self.rect().adjusted(_BAR_MARGIN_PX, 0, -_BAR_MARGIN_PX - grip_px, 0)

    def _follow(self) -> None:
        is_cut = self.is_cut
        self.setToolTip(plain_tip(self.currentMessage() if is_cut else ''))
        self.setCursor(Qt.PointingHandCursor if is_cut else Qt.ArrowCursor)


class FoldButton(QToolButton):
    """A button that folds a part: connect ``toggled``. Its arrow points down while checked."""

    def __init__(self, name: str, text: str, hint: str, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName(name)
        self.setText(text)
        self.setToolTip(plain_tip(hint))
        self.setToolButtonStyle(Qt.ToolButtonTextBesideIcon)
        self.setArrowType(Qt.RightArrow)
        self.setAutoRaise(True)
        self.setCheckable(True)
        self.setFocusPolicy(Qt.TabFocus)
        self.toggled.connect(
            lambda is_open: self.setArrowType(Qt.DownArrow if is_open else Qt.RightArrow))


_ICON_PX = 18


class NoticeFrame(QFrame):
    """A notice in a frame; its object name is ``name``, that of its text ``name_text``.

    ``color`` is good, warning or bad (see Theme).
    """

    def __init__(self, name: str, color: str, parent: Optional[QWidget] = None,
                 symbol: str = 'warning') -> None:
        super().__init__(parent)
        self.setObjectName(name)
        set_sheet(self, f'QFrame#{name} {{ border: 1px solid <{color}>; border-radius: 5px; '
                        f'background: <behind_{color}>; }}')
        self._text = WrappedLabel(f'{name}_text')
        self._sign, self._symbol = plain_label(), symbol
        self._draw_sign()
        ThemeFollower(self, self._draw_sign)
        self._layout = QGridLayout(self)
        self._layout.setContentsMargins(8, 6, 8, 6)
        self._layout.setColumnStretch(1, 1)
        self._layout.addWidget(self._sign, 0, 0, Qt.AlignTop)
        self._layout.addWidget(self._text, 0, 1)

    def _draw_sign(self) -> None:
        self._sign.setPixmap(icon(self._symbol).pixmap(QSize(_ICON_PX, _ICON_PX)))

    def add_buttons(self, *buttons: QPushButton) -> None:
        """Add buttons below the text."""
        row = QHBoxLayout()
        for button in buttons:
            row.addWidget(button)
        row.addStretch(1)
        self._layout.addLayout(row, 1, 1)


_MIN_HEIGHT_PX = 146  # avoids scrolling above the timeline on a screen of 1000 px


class PanelTabs(QTabWidget):
    """The panels of the launcher; each panel scrolls."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName('panels')
        self.setDocumentMode(True)
        self.setSizePolicy(QSizePolicy.Preferred, QSizePolicy.Ignored)
        self.setMinimumHeight(_MIN_HEIGHT_PX)  # Qt ignores minimumSizeHint with an ignored height

    def minimumSizeHint(self) -> QSize:
        """Return the width that all pages need, and a height in which a page can be used."""
        return QSize(super().minimumSizeHint().width(), _MIN_HEIGHT_PX)

    def hasHeightForWidth(self) -> bool:
        """Return False, as Qt would otherwise ask all pages for their preferred heights."""
        return False


# Six fields of a pose: x y z in m, yaw pitch roll in degrees.

_NAMES = ('x', 'y', 'z', 'yaw', 'pitch', 'roll')
_AXES = {'yaw': 'about z', 'pitch': "about y'", 'roll': "about x''"}
_REACH_M = 100.0
_STEP_M, _STEP_DEG = 0.001, 0.1


class PoseFields(QWidget):
    """Fields for a pose; only numbers that the operator changes are reported, others stay exact."""

    edited = pyqtSignal(int, float)
    """The index (0 to 5 for x y z yaw pitch roll) and the new value in m or rad."""

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._fields: List[NumberField] = [self._field(index) for index in range(len(_NAMES))]
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setHorizontalSpacing(8)
        layout.setVerticalSpacing(4)
        for index, (name, field) in enumerate(zip(_NAMES, self._fields)):
            column, row = 3 * (index // 3), index % 3
            layout.addWidget(plain_label(name), row, column)
            layout.addWidget(field, row, column + 1)
        layout.setColumnMinimumWidth(2, 12)
        layout.setColumnStretch(1, 1)
        layout.setColumnStretch(4, 1)

    def show_pose(self, pose: Pose) -> None:
        """Show xyz [m] and ypr [rad] without reporting an edit."""
        for field, value in zip(self._fields[:3], pose.xyz):
            field.show_value(value)
        for field, angle in zip(self._fields[3:], pose.ypr):
            field.show_value(math.degrees(angle))
            axis = _AXES[field.objectName()]
            field.setToolTip(plain_tip(f"{angle:.6f} rad, {axis}\n{_HINT.format('0.1°')}"))

    def _field(self, index: int) -> NumberField:
        name, is_angle = _NAMES[index], index >= 3
        field = NumberField(name)
        field.setRange(-360.0 if is_angle else -_REACH_M, 360.0 if is_angle else _REACH_M)
        field.setDecimals(2 if is_angle else 4)
        field.setSingleStep(_STEP_DEG if is_angle else _STEP_M)
        field.setSuffix('°' if is_angle else ' m')
        field.setToolTip(plain_tip(_HINT.format('1 mm')))
        field.valueChanged.connect(
            lambda value: self.edited.emit(index, math.radians(value) if is_angle else value))
        return field


_HINT = 'Arrow keys and wheel: {}; with Ctrl ten times as much'


class NumberField(QDoubleSpinBox):
    """A spin box that the wheel changes only while it has the keyboard focus."""

    def __init__(self, name: str, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName(name)
        self.setAccessibleName(name)
        self.setFocusPolicy(Qt.StrongFocus)
        self.setKeyboardTracking(False)
        self.setAlignment(Qt.AlignRight)
        self.setAccelerated(True)

    def show_value(self, value: float) -> None:
        """Show a value that was not entered here."""
        if round(value, self.decimals()) != self.value():
            self.blockSignals(True)
            self.setValue(value)
            self.blockSignals(False)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Change the value while focused; otherwise leave the wheel to the scroll area."""
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()


# Selected rows whose icons and text colors keep their meaning.

_COLOR = Qt.UserRole + 64


class RowDelegate(QStyledItemDelegate):
    """Texts of a selected row stay red, amber or gray; its background is pale.

    Ticks have the same color in all rows, regardless of the text's color; a partially checked box
    has a bar. All rows have the height of rows with an icon, so that they do not move when an icon
    appears.
    """

    def __init__(self, view: QAbstractItemView) -> None:
        super().__init__(view)
        color_selection(view, 'selected')

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex) -> None:
        """Draw the row, and its box once more: Qt gives the tick the color of the text."""
        super().paint(painter, option, index)
        row = QStyleOptionViewItem(option)
        self.initStyleOption(row, index)
        if not row.features & QStyleOptionViewItem.HasCheckIndicator:
            return
        style = row.widget.style()
        row.rect = style.subElementRect(QStyle.SE_ItemViewItemCheckIndicator, row, row.widget)
        color_indicators(row.palette, theme())
        row.state &= ~(QStyle.State_HasFocus | QStyle.State_On | QStyle.State_Off)
        is_partial = row.checkState == Qt.PartiallyChecked
        row.state |= QStyle.State_On if row.checkState == Qt.Checked else QStyle.State_Off
        style.drawPrimitive(QStyle.PE_IndicatorItemViewItemCheck, row, painter, row.widget)
        if is_partial:
            painter.fillRect(_bar(row.rect), row.palette.brush(QPalette.Text))

    def sizeHint(self, option: QStyleOptionViewItem, index: QModelIndex) -> QSize:
        """Return the size of a cell, with the height of a cell with an icon."""
        row = QStyleOptionViewItem(option)
        self.initStyleOption(row, index)
        row.features |= QStyleOptionViewItem.HasDecoration
        style = QApplication.style() if row.widget is None else row.widget.style()
        tall = style.sizeFromContents(QStyle.CT_ItemViewItem, row, QSize(), row.widget)
        return QSize(super().sizeHint(option, index).width(), tall.height())

    def initStyleOption(self, option: QStyleOptionViewItem, index: QModelIndex) -> None:
        """Give the text of a selected row the color of an unselected row."""
        super().initStyleOption(option, index)
        palette = option.palette
        name = index.data(_COLOR)
        if name:
            palette.setColor(QPalette.Text, QColor(getattr(theme(), name)))
        palette.setBrush(QPalette.HighlightedText, palette.brush(QPalette.Text))
        option.palette = palette


def _bar(box: QRect) -> QRect:
    """Return the place of the bar in a partially checked box."""
    margin = max(box.width() // 4, 2)
    height = max(box.height() // 5, 2)
    return QRect(box.left() + margin, box.center().y() - height // 2 + 1 - height % 2,
                 box.width() - 2 * margin, height)


def color_row(row: QTreeWidgetItem, column: int, name: str) -> None:
    """Set the color of a text that a RowDelegate draws; ``name`` is a field of Theme."""
    if row.data(column, _COLOR) != name:
        row.setData(column, _COLOR, name)
