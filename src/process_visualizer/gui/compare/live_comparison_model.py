# SPDX-License-Identifier: BSD-3-Clause
"""Comparison of the running cell with good runs: channels out of their band, and since when."""
from __future__ import annotations

import json
import math
import time
from typing import Any, Dict, FrozenSet, List, Mapping, Optional, Sequence, Tuple

import numpy as np
from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.curves.live_curves import MAX_S, LiveCurve, LiveWindow
from process_visualizer.figures import clock_text
from process_visualizer.gui.compare.compare_model import CompareModel
from process_visualizer.gui.live.live_curves_model import LiveCurvesModel
from process_visualizer.gui.ros.snapshots import PhaseSnapshot
from process_visualizer.runs.alignment.live_alignment import PhaseHistory
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.comparison.live_comparison import (
    LiveBands,
    LiveComparison,
    LiveDeparture,
    beyond_text,
    departure_text,
)
from process_visualizer.runs.comparison.live_runs import (
    AGAIN_S,
    FinishedRun,
    LiveRuns,
    finished_run,
    with_rest,
)
from process_visualizer.runs.comparison.timeline_bands import TimelineBand
from process_visualizer.runs.deviation.signals import Signal
from process_visualizer.runs.run import Key

_SILENT_S = 2.0
_RESUMED_S = 1.0
"""Age of the newest value below which data is not called missing [s]."""
_PLACED_S = 1.0
"""Time for which the last reported moment of the reference run stays valid [s]."""
_ANSWER_S = 20.0
"""Time allowed, on a busy computer, to load a reference run and find a moment in it [s]."""
_TOLD_S, _TOLD_COLUMN_S = 3.0, 0.1
"""Time span of the bands that are published for other programs, and of one of their columns [s]."""
_MAX_SHOWN = 2
_MAX_FINISHED = 500
_NO_PHASE = ('Not compared: /ghost does not say which moment of {} this is. Restart the nodes if '
             'this stays.')
_LOOKING = 'Not compared yet: looking for this moment in {}'
_NOTHING = ('Not compared: {} has none of the variables, forces and speeds of the running cell. Is '
            'it a recording of this cell?')
_NO_DATA = 'Not compared: no data since {}'
_RESTARTING = 'Not compared: a device is being restarted'
_RESTARTED = 'Not compared before the next run: a device was restarted during this one'
_RESUMED = 'Not compared yet: data has resumed'
_NO_RANGE = 'Not compared here: the good runs have no range at this moment of {} ({})'
_NO_RUN = 'Waiting for a run to start (reference {})'


class LiveComparisonModel(QObject):
    """Judges the live curves a few times a second while the cell runs and good runs are ticked."""

    changed = pyqtSignal()
    run_finished = pyqtSignal()
    """A run was added to ``finished``."""

    def __init__(self, compare: CompareModel, live: LiveCurvesModel,
                 parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._compare, self._live = compare, live
        self._good: Optional[GoodRuns] = None
        self._comparison: Optional[LiveComparison] = None
        self._history = PhaseHistory(MAX_S)
        self._newest: Optional[PhaseSnapshot] = None
        self._phase: Optional[PhaseSnapshot] = None  # the newest one when ``changed`` was emitted
        self._was_running = self._was_interrupted = False
        self._cut_at_s: Optional[float] = None  # moment of the reference, in a run with a restart
        self._departures: Tuple[LiveDeparture, ...] = ()
        self._lost: FrozenSet[Key] = frozenset()
        self._now_s, self._is_silent = 0.0, False
        self._known_s, self._is_stale = 0.0, False  # time of the newest value; is it too old?
        self._values_since_s = 0.0  # time of the first values to compare; 0: none yet
        self._has_common = True
        self._judged_s = 0.0  # until here, values that are missing have been counted
        self._back_s: Dict[Signal, float] = {}  # when a channel was back in range last
        self._runs: Optional[LiveRuns] = None
        self._window: Optional[LiveWindow] = None  # the last one that was judged
        self._finished: Tuple[FinishedRun, ...] = ()
        compare.changed.connect(self._follow)
        live.changed.connect(self._follow)
        live.judged.connect(self._judge)

    @property
    def finished(self) -> Tuple[FinishedRun, ...]:
        """The finished runs, including those of earlier sessions; the newest is last."""
        return self._finished

    def settings(self) -> List[Dict[str, Any]]:
        """Return the input of ``restore``."""
        return [it.settings() for it in self._finished]

    def restore(self, settings: Sequence[Mapping[str, Any]]) -> None:
        """Restore the runs of earlier sessions.

        Raises:
            KeyError, TypeError, ValueError: these are not settings.
        """
        self._finished = tuple(finished_run(it) for it in settings)
        self._change()

    @property
    def departures(self) -> Tuple[LiveDeparture, ...]:
        """Return the current departures, in the order in which the channels left their bands."""
        return self._departures

    @property
    def now_s(self) -> float:
        """Return the time of the last judgment, on the clock of the values [s since the epoch]."""
        return self._now_s

    @property
    def departed(self) -> List[Tuple[str, str, str, float]]:
        """Device, label, distance from the band and onset [s since the epoch] of each departure."""
        return [(it.signal.device, it.signal.label, beyond_text(it), it.since_s)
                for it in self._departures]

    @property
    def lost(self) -> FrozenSet[Tuple[str, str]]:
        """Device and label of the channels that cannot be judged now, for lack of values."""
        return self._lost

    @property
    def reference(self) -> str:
        """The name of the run that the running cell is compared with; empty without comparison."""
        return self._comparison.name if self._comparison and self._live.is_running else ''

    @property
    def judged_with(self) -> str:
        """The name of the reference run; also empty while ``text`` names an obstacle."""
        return '' if self._obstacle() else self.reference

    def _obstacle(self) -> str:
        """Return why nothing can be compared with the reference run; empty if something can."""
        phase = self._phase
        if self._live.is_interrupted:
            return _RESTARTING
        if self._cut_at_s is not None:
            return _RESTARTED
        if self._live.problem:
            return _no_data(self._now_s)
        if not self._has_common:
            return _NOTHING.format(self.reference)
        if self._is_stale:
            has_resumed = self._now_s - self._known_s < _RESUMED_S
            return _RESUMED if has_resumed else _no_data(self._known_s)
        if phase is None or not self._is_placed(_SILENT_S):
            asked_s = max(self._values_since_s, 0.0 if phase is None else phase.stamp_s)
            is_late = self._values_since_s and self._now_s - asked_s > _ANSWER_S
            return (_NO_PHASE if is_late else _LOOKING).format(self.reference)
        return ''

    @property
    def _is_without_band(self) -> bool:
        """Return whether the good runs have no range at all at this moment."""
        comparison, phase = self._comparison, self._phase
        return comparison is None or phase is None or phase.reference_s is None or (
            comparison.without_band(phase.reference_s).issuperset(comparison.keys))

    @property
    def text(self) -> str:
        """Return the result in words; empty while nothing is compared."""
        comparison, phase = self._comparison, self._phase
        if comparison is None or not self._live.is_running:
            return ''
        obstacle = self._obstacle()
        if obstacle or phase is None:
            return obstacle
        if phase.reference_s is None:
            return _NO_RUN.format(comparison.name)
        if not self._departures:
            has_departed = self._runs is not None and self._runs.has_departed
            text = f'{"Back" if has_departed else "Run"} in range ({_place(phase)})'
            count = len(comparison.without_band(phase.reference_s))
            if self._is_without_band:
                return _NO_RANGE.format(comparison.name, _place(phase))
            return text if 2 * count < len(comparison.keys) else \
                f'{text}; the good runs have no range here for {count} of ' \
                f'{len(comparison.keys)} values'
        shown = [departure_text(it, self._now_s) for it in self._departures[:_MAX_SHOWN]]
        more = len(self._departures) - len(shown)
        return '\n'.join(shown) + (f'\nand {more} more' if more else '')

    @property
    def told(self) -> str:
        """Return the result as JSON, for programs; see `verdict_entry` in serving/live_cell.py."""
        text = self.text
        is_in = bool(text) and not self._obstacle() and not self._is_without_band
        state = 'poor' if self._departures and text else 'good' if is_in else 'plain'
        return json.dumps({'text': text, 'state': state, 'reference': self.reference,
                           'departed': self.departed if text else [],
                           'lost': sorted(self._lost)})

    @property
    def told_bands(self) -> str:
        """Return the bands of the last seconds for programs, see `live_bands`; '' without bands."""
        window = self._window
        if window is None or not self.text:
            return ''
        count = len(_times_s(window))
        column_s = window.duration_s / count
        joined = max(round(_TOLD_COLUMN_S / column_s), 1)
        first = max(count // joined - round(_TOLD_S / column_s / joined), 0) * joined
        rows = slice(first, first + (count - first) // joined * joined)
        channels: Dict[Key, TimelineBand] = {}
        for curve in window.curves:
            band = self.band(curve, window)
            if band is None or not np.isfinite(band.low[rows]).any():
                continue
            low, high, departed = (it[rows].reshape(-1, joined) for it in band)
            channels[_key(curve)] = TimelineBand(
                np.fmin.reduce(low, axis=1), np.fmax.reduce(high, axis=1), departed.any(axis=1))
        return LiveBands(window.epoch_s + window.begin_s + first * column_s, joined * column_s,
                         channels).text() if channels else ''

    def _is_placed(self, within_s: float) -> bool:
        """Return whether a report of the moment in the reference run, or of no run, is recent."""
        return self._phase is not None and self._now_s - self._phase.stamp_s <= within_s

    def band(self, curve: LiveCurve, window: LiveWindow) -> Optional[TimelineBand]:
        """Return the band behind a curve of a window; None without a band."""
        if self._comparison is None:
            return None
        return self._comparison.band(
            _key(curve), _values(curve), self._history.at(_times_s(window)),
            window.duration_s / len(curve.low))

    def take_phase(self, phase: PhaseSnapshot) -> None:
        """Update the current moment of the reference run."""
        self._newest = phase
        self._follow_cut(phase.reference_s)
        self._history.add(phase.stamp_s, None if self._is_cut else phase.reference_s)
        if (self._runs is not None and self._has_common and self._live.is_running
                and not self._is_cut):
            self._finish(self._runs.at(phase.stamp_s, phase.reference_s))

    @property
    def _is_cut(self) -> bool:
        """Return whether a device is being restarted, or was during this run.

        It may begin anew or continue, and only its next run certainly has moments in the reference.
        """
        return self._live.is_interrupted or self._cut_at_s is not None

    def _follow_cut(self, reference_s: Optional[float]) -> None:
        if self._cut_at_s is None or self._live.is_interrupted:
            return
        if reference_s is None or reference_s < self._cut_at_s - AGAIN_S:
            self._cut_at_s = None
        else:
            self._cut_at_s = max(self._cut_at_s, reference_s)

    def _follow(self) -> None:
        """Follow changes of the good runs, and whether the cell runs."""
        compared = self._compare.compared
        good = None if compared is None else compared.good
        if good is not self._good:
            self._finish(None if self._runs is None else self._runs.end(is_watched=False))
            self._good = good
            self._comparison = None if good is None else LiveComparison(good)
            self._runs = None if good is None else LiveRuns(
                good.reference.name, good.reference.duration_s)
            self._forget()
        is_running, was_running = self._live.is_running, self._was_running
        self._was_running = is_running
        if not is_running and self._newest is not None:
            self._finish(None if self._runs is None else self._runs.end(is_watched=False))
            self._forget()
        elif is_running != was_running and self._comparison is not None:
            self._change()
        is_interrupted, was_interrupted = self._live.is_interrupted, self._was_interrupted
        self._was_interrupted = is_interrupted
        if is_interrupted and not was_interrupted:
            self._finish(None if self._runs is None else self._runs.end(is_watched=False))
            self._departures = ()
            self._cut_at_s = None if self._newest is None else self._newest.reference_s
        if is_interrupted != was_interrupted:
            self._change()
        self._live.set_judged(self._comparison is not None)
        if bool(self._live.problem) != self._is_silent:
            self._is_silent = not self._is_silent
            if self._is_silent:  # old values say nothing about the present
                self._departures = ()
                self._lost = frozenset(() if self._comparison is None else self._comparison.keys)
                if self._runs is not None:
                    self._runs.lose()
            self._change()

    def _change(self) -> None:
        """Adopt the newest moment, and notify all views, so that they show the same one."""
        self._phase = self._newest
        self.changed.emit()

    def _finish(self, run: Optional[FinishedRun]) -> None:
        if run is None:
            return
        whole = with_rest(self._finished[-1], run) if self._finished else None
        kept = self._finished if whole is None else self._finished[:-1]
        self._finished = (*kept, whole or run)[-_MAX_FINISHED:]
        self.run_finished.emit()

    def _forget(self) -> None:
        self._newest, self._departures, self._has_common = None, (), True
        self._known_s, self._is_stale, self._values_since_s = 0.0, False, 0.0
        self._judged_s, self._back_s = 0.0, {}
        self._history, self._window, self._cut_at_s = PhaseHistory(MAX_S), None, None
        self._change()

    def _take_departures(self, now: Tuple[LiveDeparture, ...]) -> None:
        """Set the present departures; one that was back in range begins again after that."""
        before = {it.signal for it in self._departures}
        present = {it.signal for it in now}
        self._back_s.update(dict.fromkeys(before - present, self._now_s))
        self._departures = _earliest(self._departures, tuple(
            it if it.signal in before else
            it._replace(since_s=max(it.since_s, self._back_s.get(it.signal, it.since_s)))
            for it in now))

    def _judge(self, window: LiveWindow) -> None:
        comparison = self._comparison
        if comparison is None or not window.curves:
            return
        times_s, values = judged_values(window)
        self._window, self._phase = window, self._newest
        self._now_s = float(times_s[-1])
        if self._is_cut:
            self._judged_s = self._now_s  # what a restart does to the values is no fault
            return
        self._values_since_s = self._values_since_s or self._now_s
        reference_s = comparison.certain(
            times_s, values, self._history.at(times_s), motions_s(window))
        self._has_common = not values.keys().isdisjoint(comparison.keys)
        self._take_departures(comparison.departures(times_s, values, reference_s))
        lost = comparison.lost(times_s, values)
        self._known_s = comparison.known_s(times_s, values) or self._known_s
        self._is_stale = self._has_common and lost.issuperset(comparison.keys) and any(
            math.isnan(it.value) for it in window.curves if _key(it) in comparison.keys)
        lost = lost if self._is_placed(_PLACED_S) else frozenset(comparison.keys)
        self._lost = lost - {(it.signal.device, it.signal.label) for it in self._departures}
        since_s = self._judged_s
        self._judged_s = max(since_s, comparison.judged_until_s(times_s, reference_s))
        if self._runs is not None and self._is_stale:
            self._runs.lose()
        elif self._runs is not None and self._has_common:
            passed = comparison.passed(times_s, values, reference_s, since_s)
            self._runs.judge((*self._departures, *passed), comparison.unjudged_s(
                times_s, values, reference_s, since_s, self._live.keys))
        elif self._runs is not None:  # a run without common channels is not of this cell
            over = self._runs.end()
            self._finish(over if over is not None and over.is_judged else None)
        self._change()


def _no_data(since_s: float) -> str:
    """Return the text for missing data since a time [s since the epoch]; 0: no data so far."""
    return _NO_DATA.format(time.strftime('%H:%M:%S', time.localtime(since_s))) if since_s \
        else 'Not compared: no data'


def _earliest(before: Tuple[LiveDeparture, ...],
              now: Tuple[LiveDeparture, ...]) -> Tuple[LiveDeparture, ...]:
    """Return departures with their earliest onset, which may lie before the judged window."""
    since_s = {it.signal: it.since_s for it in before}
    return tuple(it._replace(since_s=min(it.since_s, since_s.get(it.signal, it.since_s)))
                 for it in now)


def _place(phase: PhaseSnapshot) -> str:
    """Return the place of the run in words, such as "reference at 0:06.42, 0.4 s behind"."""
    assert phase.reference_s is not None
    place = f'reference at {clock_text(phase.reference_s)}'
    if phase.behind_s is None or abs(phase.behind_s) < 0.05:
        return place
    return f'{place}, {abs(phase.behind_s):.1f} s {"behind" if phase.behind_s > 0.0 else "ahead"}'


def judged_values(window: LiveWindow) -> Tuple[np.ndarray, Dict[Key, np.ndarray]]:
    """Return times (n,) on the recorder's clock [s since the epoch], and values (n,) by channel."""
    return _times_s(window), {_key(it): _values(it) for it in window.curves}


def motions_s(window: LiveWindow) -> List[np.ndarray]:
    """Return when the positions of each tool were measured (m,), on the recorder's clock [s]."""
    return [window.epoch_s + it.motion_s for it in window.curves if len(it.motion_s)]


def _times_s(window: LiveWindow) -> np.ndarray:
    """Return the middle times of the columns (n,), on the recorder's clock [s since the epoch]."""
    count = max((len(it.low) for it in window.curves), default=0)
    return window.epoch_s + window.begin_s + (
        np.arange(count) + 0.5) * (window.duration_s / max(count, 1))


def _values(curve: LiveCurve) -> np.ndarray:
    """Return the middle value of each column of a curve (n,)."""
    result: np.ndarray = 0.5 * (curve.low + curve.high)
    return result


def _key(curve: LiveCurve) -> Key:
    return curve.source.device, curve.source.channel_label
