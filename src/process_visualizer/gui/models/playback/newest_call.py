# SPDX-License-Identifier: BSD-3-Clause
"""Passes on the newest of many wishes (a slider that is dragged) to what takes its time."""
from __future__ import annotations

from typing import Any, Callable, Generic, Optional, TypeVar

from process_visualizer.gui.toolkit.tasks import OnError, Tasks

Value = TypeVar('Value')


class NewestCall(Generic[Value]):
    """Calls a function with the newest value: at most one call is under way, others are skipped.

    Used in the GUI thread; the function runs in a line of tasks.
    """

    def __init__(self, tasks: Tasks, line: str, function: Callable[[Value], Any],
                 on_done: Callable[[], None], on_error: OnError) -> None:
        """``on_done`` is called when the newest value was taken, ``on_error`` when one fails."""
        self._tasks = tasks
        self._line = line
        self._function = function
        self._on_done = on_done
        self._on_error = on_error
        self._under_way: Optional[Value] = None
        self._next: Optional[Value] = None

    @property
    def wanted(self) -> Optional[Value]:
        """The newest value, as long as the function has not taken it; else None."""
        return self._under_way if self._next is None else self._next

    @property
    def waiting(self) -> Optional[Value]:
        """The newest value, if its turn has not come yet; else None."""
        return self._next

    def request(self, value: Value) -> None:
        """Call the function with a value, unless a newer one comes before its turn."""
        if self._under_way is None:
            self._call(value)
        else:
            self._next = value

    def _call(self, value: Value) -> None:
        self._under_way = value
        self._tasks.run(self._line, lambda: self._function(value), self._end, self._fail)

    def _end(self, _result: Any) -> None:
        value, self._under_way, self._next = self._next, None, None
        if value is None:
            self._on_done()
        else:
            self._call(value)

    def _fail(self, error: Exception) -> None:
        self._end(None)
        self._on_error(error)


Newest = Callable[[Callable[[Any], Any]], NewestCall[Any]]
"""Makes one of a function that takes the newest value."""
