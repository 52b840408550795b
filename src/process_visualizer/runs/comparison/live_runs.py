# SPDX-License-Identifier: BSD-3-Clause
"""The runs of a cell that is followed live: when each began and ended, and its verdict."""
from __future__ import annotations

from typing import Any, Dict, Iterable, List, Mapping, NamedTuple, Optional, Tuple

from process_visualizer.runs.comparison.live_comparison import LiveDeparture
from process_visualizer.runs.comparison.wording import clock, quantity

_AGAIN_S = 1.0
"""A moment of the reference that is so much earlier belongs to another run."""
_UNKNOWN_S = 1.0
"""A run is over when no moment of the reference has been known for so long."""
_SHORTEST_S = 1.0
_OPEN_END_S = 0.5
"""How much of the reference may be missing at the end of a whole run."""


class FinishedRun(NamedTuple):
    """A run that is over; times in s since the epoch. ``departed`` names what was out of range.

    ``broken_off_s`` is the moment of the reference at which it ended too early; None if it did not.
    """

    began_s: float
    ended_s: float
    reference: str
    departed: Tuple[str, ...] = ()
    is_judged: bool = True
    broken_off_s: Optional[float] = None

    @property
    def is_good(self) -> bool:
        """Return whether it was judged, to its end, and nothing was out of range."""
        return self.is_judged and not self.departed and self.broken_off_s is None

    @property
    def verdict(self) -> str:
        """Return what is to be said of it."""
        end = [] if self.broken_off_s is None else [f'broken off at {clock(self.broken_off_s)}']
        if not self.is_judged:
            return ', '.join(['no data', *end])
        return ', '.join([f'out of range: {"; ".join(self.departed)}' if self.departed
                          else 'in range', *end])

    def settings(self) -> Dict[str, Any]:
        """Return what ``finished_run`` needs."""
        return dict(self._asdict(), departed=list(self.departed))


def finished_run(settings: Mapping[str, Any]) -> FinishedRun:
    """Return what ``settings`` returned.

    Raises:
        KeyError, TypeError, ValueError: it is something else.
    """
    broken_off_s = settings['broken_off_s']
    return FinishedRun(float(settings['began_s']), float(settings['ended_s']),
                       str(settings['reference']), tuple(str(it) for it in settings['departed']),
                       bool(settings['is_judged']),
                       None if broken_off_s is None else float(broken_off_s))


class _Run(NamedTuple):
    began_s: float
    last_s: float
    reference_s: float


class LiveRuns:
    """Follows the moments of a reference, and what is out of range at them."""

    def __init__(self, reference: str, duration_s: float) -> None:
        """Take the reference's name and how long it is."""
        self._reference, self._duration_s = reference, duration_s
        self._run: Optional[_Run] = None
        self._departed: Dict[str, Tuple[LiveDeparture, float]] = {}
        self._is_judged = False

    def at(self, stamp_s: float, reference_s: Optional[float]) -> Optional[FinishedRun]:
        """Take which moment of the reference it is [s]; return the run that is over by that."""
        run = self._run
        if reference_s is None:
            is_over = run is not None and stamp_s - run.last_s > _UNKNOWN_S
            return self.end() if is_over else None
        if run is None:
            self._run = _Run(stamp_s, stamp_s, reference_s)
            return None
        if reference_s > run.reference_s - _AGAIN_S:
            self._run = _Run(run.began_s, stamp_s, reference_s)
            return None
        finished = self.end()
        self._run = _Run(stamp_s, stamp_s, reference_s)
        return finished

    def judge(self, departures: Iterable[LiveDeparture]) -> None:
        """Take what is out of range now; the farthest of each channel counts."""
        run = self._run
        if run is None:
            return
        self._is_judged = True
        for it in departures:
            before = self._departed.get(it.signal.name)
            from_s = run.reference_s if before is None else before[1]
            if before is None or abs(it.beyond) > abs(before[0].beyond):
                self._departed[it.signal.name] = it, from_s

    def end(self) -> Optional[FinishedRun]:
        """Return the run that was going on, which is over; None without one."""
        run, departed, is_judged = self._run, self._departed, self._is_judged
        self._run, self._departed, self._is_judged = None, {}, False
        if run is None or run.last_s - run.began_s < _SHORTEST_S:
            return None
        texts: List[str] = [_text(it, from_s) for it, from_s in departed.values()]
        is_whole = run.reference_s > self._duration_s - _OPEN_END_S
        return FinishedRun(run.began_s, run.last_s, self._reference, tuple(texts), is_judged,
                           None if is_whole else run.reference_s)


def _text(departure: LiveDeparture, from_s: float) -> str:
    return (f'{departure.signal.name} {quantity(departure.signal, departure.beyond, sign=True)} '
            f'from {clock(from_s)}')
