# SPDX-License-Identifier: BSD-3-Clause
"""Reads the curves of the running cell in the background; decides how often, by its cost."""
from __future__ import annotations

import time
from typing import FrozenSet, List, Optional, Protocol, Sequence, Tuple

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.cell.model import Device, Mode
from process_visualizer.clients.service_connection import ServiceUnreachable
from process_visualizer.curves.curve_sources import curve_sources
from process_visualizer.curves.live_curves import LiveCurves, LiveWindow, RecentPart
from process_visualizer.generate.plan import BAG_PART
from process_visualizer.gui.recording.recording_state import NOT_RESPONDING
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks

MAX_SHARE = 0.08
"""Maximum share of a core for reading and drawing; beyond it the curves update less often."""
_CALM_SHARE = 0.75 * MAX_SHARE  # below this share the period gets shorter again
_STEP = 1.2
MAX_MS = 500


class LookPace:
    """Lengthens the period while looks exceed their share of a core, and shortens it afterwards."""

    def __init__(self) -> None:
        self._factor = 1.0

    def period_ms(self, wanted_ms: int, spent_s: float, elapsed_s: float) -> int:
        """Return the time to wait until the next look.

        ``spent_s`` is the processor time of the last look and its picture, ``elapsed_s`` the time
        from that look to this one.
        """
        share = spent_s / elapsed_s if elapsed_s > 0.0 else 0.0
        if share > MAX_SHARE:
            self._factor *= _STEP
        elif share < _CALM_SHARE:
            self._factor /= _STEP
        self._factor = min(max(self._factor, 1.0), max(MAX_MS / wanted_ms, 1.0))
        return round(wanted_ms * self._factor)


LINE = 'live curves'
_SILENT = f'{NOT_RESPONDING}; the curves continue when it responds'
_ENDED = 'The recorder has ended. Restart it from its alarm to continue the curves'
DURATIONS_S = (30.0, 60.0, 120.0, 300.0, 600.0)
"""Lengths of the past to choose from; the first is the length of the recorder's memory."""
_JUDGED_S = 30.0
_PERIOD_MS = 200  # from one look to the next: five pictures a second
_LONGER_PERIODS = ((600.0, 1000), (120.0, 500))  # length [s], period [ms]: one pixel
_RETRY_MS = 1000
_LATE_MS = 1000
"""Longer than a look takes, and shorter than the timeout for a recorder that hangs."""


class Memory(Protocol):
    """The memory of a recorder."""

    def read(self, topics: Sequence[str]) -> Tuple[RecentPart, bool]:
        """Return new messages, and whether there are more; raise ServiceUnreachable if it fails."""

    def restart(self) -> None:
        """Read everything again."""


class LiveCurvesModel(QObject):
    """Reads new data a few times a second while the cell runs and the curves are used."""

    changed = pyqtSignal()
    judged = pyqtSignal(object)
    """A LiveWindow of the last half minute, to be judged; emitted even while on hold."""

    def __init__(self, tasks: Tasks, memory: Memory, session: Session,
                 parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks, self._memory, self._session = tasks, memory, session
        self._devices: Tuple[Device, ...] = ()
        self._curves = LiveCurves(())  # used only in the line of tasks
        self._is_running = self._is_shown = self._is_held = self._is_reading = False
        self._is_judged = False
        self._duration_s = DURATIONS_S[0]
        self._begun = 0  # how often reading began anew
        self._window: Optional[LiveWindow] = None
        self._newest: Optional[LiveWindow] = None  # also while another one is held
        self._kept: Optional[LiveWindow] = None  # for ``renew``
        self._is_silent = False
        self._pace, self._read_s = LookPace(), 0.0
        self._taken_s = self._drawn_s = 0.0  # at the last look: time, and this thread's time
        self._timer = QTimer(self, singleShot=True)
        self._timer.timeout.connect(self._read)
        self._is_late = False
        self._late = QTimer(self, singleShot=True, interval=_LATE_MS)
        self._late.timeout.connect(lambda: self._set_late(True))
        for other in (session.cell_changed, session.run_changed):
            other.connect(lambda: self._follow_devices(session.live_devices))
        self._has_ended = self._is_interrupted = False
        session.run_changed.connect(self._follow_run)

    @property
    def window(self) -> Optional[LiveWindow]:
        """Return the values to show; None before the first message."""
        return self._window

    @property
    def keys(self) -> FrozenSet[Tuple[str, str]]:
        """Return device and label of all curves that the running devices can have."""
        return frozenset((it.device, it.channel_label) for it in curve_sources(self._devices))

    @property
    def duration_s(self) -> float:
        """Return the length of the past that is shown."""
        return self._duration_s

    @property
    def is_running(self) -> bool:
        """Return whether the cell runs, so that there is a recorder to read from."""
        return self._is_running

    @property
    def is_interrupted(self) -> bool:
        """Return whether a device is being restarted: its values are not those of the process."""
        return self._is_interrupted

    @property
    def is_held(self) -> bool:
        """Return whether the picture is on hold; new data is still read."""
        return self._is_held

    @property
    def is_stale(self) -> bool:
        """Return whether the newest data is stale although the picture is not on hold."""
        return bool(self.problem) or self._is_late

    @property
    def problem(self) -> str:
        """Return why no new data arrives while the cell runs; empty if all is well."""
        if not self._is_running:
            return ''
        return _ENDED if self._has_ended else _SILENT if self._is_silent else ''

    def _follow_devices(self, devices: Tuple[Device, ...]) -> None:
        before, self._devices = self._devices, devices
        if _determinants(devices) != _determinants(before):
            self._begin_anew()

    def _follow_run(self) -> None:
        """Note that a recorder was launched or has ended; its last curves stay visible."""
        is_running = self._session.running_mode is Mode.REALTIME
        before = self.problem, self._is_interrupted
        self._is_interrupted = is_running and self._session.is_restarting
        self._has_ended = self._session.has_ended(BAG_PART)
        if is_running != self._is_running:
            self._is_running, self._is_silent = is_running, False
            if is_running:
                self._begin_anew()
            self._follow()
            self.changed.emit()
        elif (self.problem, self._is_interrupted) != before:
            self.changed.emit()

    def set_shown(self, is_shown: bool) -> None:
        """Set whether the curves are visible."""
        self._is_shown = is_shown
        self._follow()

    def set_judged(self, is_judged: bool) -> None:
        """Set whether new values are judged, even while the curves are not visible."""
        if is_judged != self._is_judged:
            self._is_judged = is_judged
            self._follow()

    def set_duration(self, duration_s: Optional[float]) -> None:
        """Show this length of the past, one of DURATIONS_S; others are ignored."""
        if duration_s in DURATIONS_S:
            self._duration_s = duration_s
            self.changed.emit()
            self._follow(now=True)

    def hold(self, is_held: bool) -> None:
        """Hold the picture, or let it continue."""
        self._is_held, self._kept = is_held, None
        if not is_held:
            self._window = self._newest
        self.changed.emit()

    def keep(self) -> None:
        """Keep the newest picture for ``renew``."""
        self._kept = self._newest

    def renew(self) -> None:
        """Hold the picture that was kept in place of the one that is held."""
        if self._is_held and self._kept is not None and self._kept is not self._window:
            self._window = self._kept
            self.changed.emit()

    def _begin_anew(self) -> None:
        self._newest = self._kept = None
        devices, self._window, self._is_held = self._devices, None, False
        self._begun += 1
        self._tasks.run(LINE, lambda: self._set_curves(devices))
        self.changed.emit()

    def _set_curves(self, devices: Tuple[Device, ...]) -> None:
        """Set the devices whose curves are read; runs as a task."""
        self._curves = LiveCurves(devices)
        self._memory.restart()

    def _follow(self, now: bool = False) -> None:
        """Start or stop reading."""
        if not self._is_wanted:
            self._timer.stop()
        elif not self._is_reading and (now or not self._timer.isActive()):
            self._read()

    def _read(self) -> None:
        self._is_reading, begun = True, self._begun
        self._late.start()
        durations_s = self._duration_s, *((_JUDGED_S,) if self._is_judged else ())
        self._tasks.run(LINE, lambda: self._looked(durations_s),
                        lambda windows: self._take(windows, begun),
                        lambda error: self._fail(error, begun))

    def _looked(self, durations_s: Sequence[float]) -> List[LiveWindow]:
        """Return new windows of these lengths; runs as a task."""
        begin_s, more = time.thread_time(), True
        while more:
            part, more = self._memory.read(self._curves.topics)
            self._curves.add(part)
        windows = [self._curves.window(it) for it in durations_s]
        self._read_s = time.thread_time() - begin_s
        return windows

    def _set_late(self, is_late: bool) -> None:
        """Set whether the recorder's answer is overdue."""
        if is_late != self._is_late:
            self._is_late = is_late
            self.changed.emit()

    def _take(self, windows: List[LiveWindow], begun: int) -> None:
        self._late.stop()
        if begun != self._begun:
            self._read_again()
            return
        was_silent = self._is_silent or self._is_late
        self._is_silent = self._is_reading = self._is_late = False
        window, *judged = windows
        for it in judged:
            self.judged.emit(it)
        self._newest = window
        if not self._is_held:
            self._window = window
        if not self._is_held or was_silent:
            self.changed.emit()
        wanted_ms = _PERIOD_MS if judged else next(
            (it for least_s, it in _LONGER_PERIODS if window.duration_s >= least_s), _PERIOD_MS)
        self._wait(self._paced_ms(wanted_ms))

    def _paced_ms(self, wanted_ms: int) -> int:
        """Return the period that follows from the cost of the last look and of its picture."""
        now_s, drawn_s = time.monotonic(), time.thread_time()
        spent_s = self._read_s + drawn_s - self._drawn_s
        period_ms = self._pace.period_ms(wanted_ms, spent_s, now_s - self._taken_s)
        self._taken_s, self._drawn_s = now_s, drawn_s
        return period_ms

    def _read_again(self) -> None:
        """Read again after a result that does not belong to the present devices and recorder."""
        self._is_reading = False
        self._set_late(False)
        self._follow()

    def _fail(self, error: Exception, begun: int) -> None:
        self._late.stop()
        if not isinstance(error, ServiceUnreachable):
            self._is_reading = self._is_late = False
            raise error
        if begun != self._begun:
            self._read_again()
            return
        self._is_reading = self._is_late = False
        self._is_silent = True
        self.changed.emit()
        self._wait(_RETRY_MS)

    def _wait(self, period_ms: int) -> None:
        if self._is_wanted:
            self._timer.start(period_ms)

    @property
    def _is_wanted(self) -> bool:
        return self._is_running and (self._is_shown or self._is_judged)


def _determinants(devices: Tuple[Device, ...]) -> Tuple[object, ...]:
    """Return what determines the curves of devices: the place of a device in the cell does not."""
    return curve_sources(devices), *(
        (it.name, it.tool and (it.tool.frame, it.tool.pose),
         [(topic.name, topic.function, topic.message_type) for topic in it.topics])
        for it in devices)
