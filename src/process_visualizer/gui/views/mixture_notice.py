"""Says in red who publishes what does not belong to what is shown; not there while all is well."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import QSize, Qt
from PyQt5.QtWidgets import QFrame, QHBoxLayout, QLabel, QWidget

from process_visualizer.cell.model import Mode
from process_visualizer.gui.icons import icon
from process_visualizer.gui.models.mixture_model import MixtureModel
from process_visualizer.gui.style import BAD

_ICON_PX = 18
_MOST_TOLD = 3
_MEANING = {
    Mode.PLAYBACK: '{}, beside the recording: what you see is a mixture. Stop that node.',
    Mode.REALTIME: '{}, which plays a recording: what you see is a mixture. Stop that player.'}


class MixtureNotice(QFrame):
    """Shows a mixture model."""

    def __init__(self, model: MixtureModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._model = model
        self.setObjectName('mixture')
        self.setStyleSheet(f'QFrame#mixture {{ border: 1px solid {BAD}; border-radius: 5px; '
                           'background: #fdf4f3; }')
        self._text = QLabel()
        self._text.setObjectName('mixture_text')
        self._text.setWordWrap(True)
        self._text.setTextFormat(Qt.PlainText)
        self._text.setTextInteractionFlags(Qt.TextSelectableByMouse)
        symbol = QLabel()
        symbol.setPixmap(icon('warning').pixmap(QSize(_ICON_PX, _ICON_PX)))
        layout = QHBoxLayout(self)
        layout.setContentsMargins(8, 6, 8, 6)
        layout.addWidget(symbol, 0, Qt.AlignTop)
        layout.addWidget(self._text, 1)
        model.changed.connect(self._show)
        self._show()

    def _show(self) -> None:
        sentences, mode = self._model.sentences, self._model.mode
        if sentences and mode is not None:
            more = len(sentences) - _MOST_TOLD
            told = '; '.join(sentences[:_MOST_TOLD]) + (f'; and {more} more' if more > 0 else '')
            self._text.setText(_MEANING[mode].format(told))
            self._text.setToolTip('\n'.join(sentences))
        self.setVisible(bool(sentences) and mode is not None)
