# SPDX-License-Identifier: BSD-3-Clause
"""Says in red which nodes publish topics that do not belong to the display; hidden if none."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtWidgets import QWidget

from process_visualizer.cell.model import Mode
from process_visualizer.gui.models.cell.mixture_model import MixtureModel
from process_visualizer.gui.views.parts.notice_frame import NoticeFrame

_MOST_SENTENCES = 3
_MEANING = {
    Mode.PLAYBACK: '{}, in addition to the recording: what you see is a mixture. Stop that node.',
    Mode.REALTIME: '{}, which plays a recording: what you see is a mixture. Stop that player.'}


class MixtureNotice(NoticeFrame):
    """Shows a mixture model."""

    def __init__(self, model: MixtureModel, parent: Optional[QWidget] = None) -> None:
        super().__init__('mixture', 'bad', parent)
        self._model = model
        model.changed.connect(self._show)
        self._show()

    def _show(self) -> None:
        sentences, mode = self._model.sentences, self._model.mode
        if sentences and mode is not None:
            more = len(sentences) - _MOST_SENTENCES
            text = '; '.join(sentences[:_MOST_SENTENCES])
            text += f'; and {more} more' if more > 0 else ''
            self._text.setText(_MEANING[mode].format(text))
            self._text.setToolTip('\n'.join(sentences))
        self.setVisible(bool(sentences) and mode is not None)
