# SPDX-License-Identifier: BSD-3-Clause
"""The last output of a node (or of the roslaunch of a device) before it ended."""
from __future__ import annotations

from typing import Optional, Sequence

from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QWidget

from process_visualizer.gui.views.parts.text_dialog import TextDialog
from process_visualizer.launching.exit_words import exit_words
from process_visualizer.launching.node_state import NodeReport, NodeState
from process_visualizer.launching.part_report import PartReport


class LogView(TextDialog):
    """A window with a node's name, its exit code and its last lines; deletes itself."""

    def __init__(self, title: str, message: str, lines: Sequence[str],
                 parent: Optional[QWidget] = None) -> None:
        super().__init__('log', title, parent)
        self.setAttribute(Qt.WA_DeleteOnClose)
        self.show_text(message, '\n'.join(lines))
        self.text.verticalScrollBar().setValue(self.text.verticalScrollBar().maximum())
        if not lines:
            self.text.setPlaceholderText('The log is empty.')

    @classmethod
    def show_node(cls, parent: QWidget, report: PartReport, node: str) -> LogView:
        """Open the log of a node of a part, or of the whole part if there is no such node."""
        found = next((it for it in report.nodes if it.name == node), None)
        if found is None:
            view = cls(f'{report.part}: log', part_message(report), report.log_tail, parent)
        else:
            view = cls(f'{node}: log', node_message(report.part, found),
                       found.log_tail or report.log_tail, parent)
        view.show()
        return view


def node_message(part: str, node: NodeReport) -> str:
    """Return the fate of a node, in a sentence of rich text."""
    name = f'<b>{node.name}</b> of {part}'
    again = f' It was restarted {node.restarts} times.' if node.restarts else ''
    if node.state is NodeState.EXITED:
        return f'{name}: {exit_words(node.exit_code)}.{again}'
    if node.state is NodeState.FAILED:
        return f'{name} could not be started: {node.reason}'
    state = 'runs' if node.state is NodeState.RUNNING else 'is starting'
    return f'{name} {state}.{again}'


def part_message(report: PartReport) -> str:
    """Return the fate of a part, in a sentence of rich text."""
    reason = f': {report.reason}' if report.reason else ''
    return f'<b>{report.part}</b> is {report.state.value}{reason}'
