# SPDX-License-Identifier: BSD-3-Clause
"""The warnings of the nodes of a device, as long as they last."""
from __future__ import annotations

import html
import time
from typing import Optional, Sequence

from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QPlainTextEdit, QWidget

from process_visualizer.gui.models.cell.device_states_model import DeviceStatesModel
from process_visualizer.gui.views.parts.text_dialog import TextDialog
from process_visualizer.health.node_warnings import NodeWarning, Severity, counted


class WarningsView(TextDialog):
    """A window with the present warnings of a device; deletes itself."""

    def __init__(self, device: str, states: DeviceStatesModel,
                 parent: Optional[QWidget] = None) -> None:
        super().__init__('warnings', f'{device}: warnings', parent)
        self.setAttribute(Qt.WA_DeleteOnClose)
        self._device, self._states = device, states
        self.text.setLineWrapMode(QPlainTextEdit.WidgetWidth)
        self.text.setPlaceholderText('No warnings any more: the problems are over.')
        self.text.setAccessibleName(f'Warnings of {device}')
        states.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the present warnings; the selection stays if the texts are the same."""
        warnings = self._states.warnings(self._device)
        text = warnings_text(warnings, time.monotonic())
        if text != self.text.toPlainText() and not self.text.textCursor().hasSelection():
            place = self.text.verticalScrollBar().value()
            self.show_text(warnings_message(self._device, warnings), text)
            self.text.verticalScrollBar().setValue(place)


def warnings_message(device: str, warnings: Sequence[NodeWarning]) -> str:
    """Return the number of warnings, in a sentence of rich text."""
    name = f'<b>{html.escape(device)}</b>'
    if not warnings:
        return f'The nodes of {name} have no warnings now.'
    return f'{name}: {counted(warnings)} now. A warning disappears when its cause is gone.'


def warnings_text(warnings: Sequence[NodeWarning], now_s: float) -> str:
    """Return the warnings with their nodes, counts and durations."""
    return '\n\n'.join(f'{_title(it, now_s)}:\n{it.text}' for it in warnings)


def _title(warning: NodeWarning, now_s: float) -> str:
    severity = 'error' if warning.severity is Severity.ERROR else 'warning'
    often = f'{warning.count} times ' if warning.count > 1 else ''
    return f'{warning.node}, {severity}, {often}for {max(now_s - warning.since_s, 0.0):.0f} s'
