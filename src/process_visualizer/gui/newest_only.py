"""Of many commands that come faster than they are done, only the newest waits."""
from __future__ import annotations

from typing import Any, Callable, NamedTuple, Optional

from process_visualizer.gui.tasks import OnError, OnResult, Tasks


class _Command(NamedTuple):
    function: Callable[[], Any]
    on_result: OnResult
    on_error: OnError


class NewestOnly:
    """Runs commands in a line of the tasks; what came in the meantime is replaced by the newest."""

    def __init__(self, tasks: Tasks, line: str) -> None:
        self._tasks = tasks
        self._line = line
        self._is_busy = False
        self._waiting: Optional[_Command] = None

    def run(self, function: Callable[[], Any], on_result: OnResult, on_error: OnError) -> None:
        """Run it now, or after the one that runs if no newer one has come by then."""
        self._waiting = _Command(function, on_result, on_error)
        if not self._is_busy:
            self._next()

    def _next(self) -> None:
        if self._waiting is None:
            return
        command, self._waiting = self._waiting, None
        self._is_busy = True
        self._tasks.run(self._line, command.function,
                        lambda result: self._done(command.on_result, result),
                        lambda error: self._done(command.on_error, error))

    def _done(self, tell: Callable[[Any], None], outcome: Any) -> None:
        self._is_busy = False
        self._next()
        tell(outcome)
