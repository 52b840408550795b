# SPDX-License-Identifier: BSD-3-Clause
"""Names from files, topics and logs are displayed literally and never interpreted as HTML."""
from __future__ import annotations

import ast
from pathlib import Path
from typing import Any, Iterator, Tuple

import pytest
from PyQt5.QtCore import Qt
from PyQt5.QtGui import QTextDocument
from PyQt5.QtWidgets import QLabel

import process_visualizer.gui.toolkit.labels as labels
from process_visualizer.gui.cell.devices_panel import node_message, part_message
from process_visualizer.gui.toolkit.dialogs import message_box
from process_visualizer.gui.toolkit.labels import plain_label, plain_tip
from process_visualizer.gui.toolkit.widgets import ElidedLabel, WrappedLabel
from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport, PartState

_ODD = '<b>a</b> &amp; b.bag'
_FOLDER = Path(labels.__file__).parent.parent


def text_of(html: str) -> str:
    document = QTextDocument()
    document.setHtml(html)
    return document.toPlainText()


def test_a_tooltip_shows_a_name_as_it_is() -> None:
    assert plain_tip('/a/b.bag\n<b>') == '/a/b.bag\n<b>', 'Qt looks only at the first line'
    assert Qt.mightBeRichText(plain_tip(_ODD)) and text_of(plain_tip(_ODD)) == _ODD


@pytest.mark.parametrize('label', [plain_label, ElidedLabel, lambda: WrappedLabel('a')])
def test_a_label_shows_a_name_as_it_is(qtbot: Any, label: Any) -> None:
    found = label()
    qtbot.addWidget(found)
    assert found.textFormat() == Qt.PlainText


def test_a_message_shows_a_name_as_it_is(qtbot: Any) -> None:
    box = message_box(None, f'{_ODD} cannot be read')
    qtbot.addWidget(box)
    assert box.findChild(QLabel, 'qt_msgbox_label').textFormat() == Qt.PlainText


def test_names_within_html_are_escaped() -> None:
    node = NodeReport(_ODD, NodeState.FAILED, reason=_ODD)
    assert text_of(node_message(_ODD, node)) == f'{_ODD} of {_ODD} could not be started: {_ODD}'
    part = PartReport(_ODD, PartState.FAILED, (), _ODD)
    assert text_of(part_message(part)) == f'{_ODD} is failed: {_ODD}'


def _calls() -> Iterator[Tuple[str, str, ast.Call]]:
    """Yield the file, the name and the call of all calls in the window's sources."""
    for path in sorted(_FOLDER.rglob('*.py')):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Call):
                name = getattr(node.func, 'attr', getattr(node.func, 'id', ''))
                yield str(path.relative_to(_FOLDER)), name, node


def _is_safe(text: ast.expr) -> bool:
    """Return whether a tooltip is constant or displayed literally."""
    if isinstance(text, ast.IfExp):
        return _is_safe(text.body) and _is_safe(text.orelse)
    if isinstance(text, ast.Call):
        return isinstance(text.func, ast.Name) and text.func.id == 'plain_tip'
    return isinstance(text, ast.Constant) or (isinstance(text, ast.Name) and text.id.isupper())


def test_no_label_or_tooltip_is_left_to_the_guess_of_qt() -> None:
    unsafe = []
    for file, name, call in _calls():
        is_role = name == 'setItemData' and 'ToolTipRole' in ast.dump(call)
        text = call.args[-1] if name == 'setToolTip' else \
            call.args[1] if name == 'showText' or is_role else None
        if (name == 'QLabel' and file != 'toolkit/labels.py') or (text is not None
                                                            and not _is_safe(text)):
            unsafe.append(f'{file}:{call.lineno}')
    assert unsafe == []
