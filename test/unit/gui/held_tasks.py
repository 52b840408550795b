# SPDX-License-Identifier: BSD-3-Clause
"""Tasks that end on the test's command, and other shared helpers."""
from __future__ import annotations

from typing import Any, Callable, List, Optional, Tuple

from pytestqt.qtbot import QtBot

from process_visualizer.gui.toolkit.tasks import Tasks

Pending = Tuple[str, Callable[[], Any], Optional[Callable[[Any], None]],
                Optional[Callable[[Exception], None]]]


class HeldTasks:
    """Stand-in for Tasks: a task runs in the calling thread on the test's command."""

    def __init__(self) -> None:
        self.held: List[Pending] = []

    def run(self, line: str, function: Callable[[], Any],
            on_result: Optional[Callable[[Any], None]] = None,
            on_error: Optional[Callable[[Exception], None]] = None) -> None:
        self.held.append((line, function, on_result, on_error))

    def end_one(self) -> None:
        """Run the oldest task."""
        _line, function, on_result, on_error = self.held.pop(0)
        try:
            result = function()
        except Exception as error:
            if on_error is None:
                raise
            on_error(error)
        else:
            if on_result is not None:
                on_result(result)

    def end_all(self) -> None:
        """Run all tasks, and those that they start."""
        while self.held:
            self.end_one()


def wait_for_line(tasks: Tasks, line: str, qtbot: QtBot) -> None:
    """Wait until all present tasks of a line have ended, and their results have been delivered."""
    ended: List[None] = []
    tasks.run(line, lambda: None, ended.append)
    qtbot.waitUntil(lambda: bool(ended))


class Refused(Exception):
    """Error of the recording client on the test's request."""


class RecordingClient:
    """Stand-in for PlayerClient: notes the commands; refuses the next one if given a reason."""

    def __init__(self) -> None:
        self.commands: List[Tuple[Any, ...]] = []
        self.reason = ''

    def __getattr__(self, name: str) -> Callable[..., None]:
        if name.startswith('_'):
            raise AttributeError(name)

        def command(*arguments: Any) -> None:
            if self.reason:
                reason, self.reason = self.reason, ''
                raise Refused(reason)
            self.commands.append((name, *arguments))
        return command

    def taken(self) -> List[Tuple[Any, ...]]:
        """The commands since the last call."""
        commands, self.commands = self.commands, []
        return commands
