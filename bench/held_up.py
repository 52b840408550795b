# SPDX-License-Identifier: BSD-3-Clause
"""Measures how long the window is blocked while an operator works, compared with an idle program.

usage: bench/run held_up

The simulated cell without its Kinect, in the real window with RViz: launched, recorded, replayed,
played back, scrubbed, stepped, looped, played backwards, shown in another theme, and quit. A peer
in a process of its own has an event loop with the same ticks, asks the X server for the mouse
position at each, and does nothing else: the machine causes the times in which it is blocked. The
others are the window's. The program ends with 1 if one of them was longer than 50 ms.
"""
from __future__ import annotations

import os
import subprocess
import sys
import time
from typing import Callable, Dict, List, NamedTuple, Tuple

from bench_window import BenchWindow, pause, until
from PyQt5.QtCore import QEvent, QPoint, QPointF, QSocketNotifier, Qt, QTimer
from PyQt5.QtGui import QCursor, QGuiApplication, QMouseEvent
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QApplication, QWidget

from process_visualizer.cell.model import Mode
from process_visualizer.gui.app.watchdog import BEAT_MS, Entry, Watchdog, read_report
from process_visualizer.gui.live.replay_model import ReplayPhase
from process_visualizer.gui.toolkit.theme import DARK, LIGHT, apply_theme

LIMIT_MS = 50.0
PEER_LIMIT_S = 0.02
RECORDED_S, LOOKED_S, MOVES, STEPS = 8.0, 4.0, 40, 20


class Held(NamedTuple):
    """A time in which the window was blocked: its end [s since the epoch] and its length [ms]."""

    until_s: float
    lasted_ms: float
    own_ms: float
    stack: str


def span_s(block: Entry) -> Tuple[float, float]:
    """Return begin and end [s since the epoch] of a block of a thread."""
    return float(block['at']) - 0.001 * float(block['blocked_ms']), float(block['at'])


def held(blocks: List[Entry], of_peer: List[Entry]) -> List[Held]:
    """Return the window's own blocks, without those of the peer and waits for a processor.

    The kernel reports the waits. The measured value is the time between two ticks, which is up to
    one interval longer than the block.
    """
    found = []
    for block in blocks:
        begin_s, end_s = span_s(block)
        machine_ms = 1000.0 * sum(max(0.0, min(end_s, peer_end_s) - max(begin_s, peer_begin_s))
                                  for peer_begin_s, peer_end_s in map(span_s, of_peer))
        own_ms = float(block['blocked_ms']) - BEAT_MS - max(machine_ms, float(block['waited_ms']))
        found.append(Held(end_s, float(block['blocked_ms']), own_ms, str(block['stack'])))
    return found


class Work:
    """Performs an operator's steps; records when each step has begun."""

    def __init__(self, bench: BenchWindow) -> None:
        self._bench, self._launcher = bench, bench.launcher
        self.began_s: Dict[str, float] = {}

    def do(self) -> None:
        """Do all steps."""
        for step in (self.launch, self.look_at_curves, self.record, self.replay, self.play_back,
                     self.scrub, self.step, self.loop_backwards, self.change_theme, self.go_live,
                     self.quit):
            self.began_s[step.__name__.replace('_', ' ')] = time.time()
            step()

    def launch(self) -> None:
        self._launcher.cell.tick('kinect', False)
        self._bench.launch()

    def look_at_curves(self) -> None:
        until(lambda: self._launcher.live.window is not None, 60.0)
        pause(LOOKED_S)

    def record(self) -> None:
        self.bag = self._bench.record(RECORDED_S)

    def replay(self) -> None:
        timeline, replay = self._bench.window.live.timeline, self._launcher.replay
        place = QPoint(int(timeline.axis.x(-0.5 * RECORDED_S)), 60)
        QTest.mouseClick(timeline, Qt.LeftButton, Qt.NoModifier, place)
        until(lambda: replay.phase is ReplayPhase.SHOWN, 120.0)
        replay.leave()

    def play_back(self) -> None:
        self._launcher.bag.open([self.bag])
        until(lambda: self._launcher.session.paths == (self.bag,), 60.0)
        self._launcher.choose_mode(Mode.PLAYBACK)
        until(lambda: (self._launcher.playback.state.is_available
                       and self._launcher.launch.is_running), 120.0)
        until(lambda: bool(self._launcher.bag.curves.curves), 60.0)
        self._launcher.playback.play()
        pause(LOOKED_S)

    def scrub(self) -> None:
        timeline = self._bench.window.playback.timeline
        begin = QPoint(timeline.width() // 4, 40)
        self.drag(timeline, [begin + QPoint(move * timeline.width() // 80, 0)
                             for move in range(MOVES)])

    def step(self) -> None:
        for _ in range(STEPS):
            self._launcher.playback.step(1)
            pause(0.05)

    def loop_backwards(self) -> None:
        playback = self._launcher.playback
        playback.toggle_loop()
        playback.play_backwards()
        pause(LOOKED_S)
        playback.set_rate(-4.0)
        pause(LOOKED_S)

    def change_theme(self) -> None:
        app = QApplication.instance()
        assert isinstance(app, QApplication)
        for theme in (DARK, LIGHT):
            apply_theme(app, theme)
            pause(0.5)

    def go_live(self) -> None:
        self._launcher.choose_mode(Mode.REALTIME)
        until(lambda: self._launcher.launch.is_running
              and self._launcher.launch.running.mode is Mode.REALTIME, 120.0)
        pause(LOOKED_S)

    def quit(self) -> None:
        self._bench.quit()

    def drag(self, widget: QWidget, places: List[QPoint]) -> None:
        QTest.mousePress(widget, Qt.LeftButton, Qt.NoModifier, places[0])
        for place in places[1:]:
            QApplication.sendEvent(widget, QMouseEvent(
                QEvent.MouseMove, QPointF(place), Qt.NoButton, Qt.LeftButton, Qt.NoModifier))
            pause(0.02)
        QTest.mouseRelease(widget, Qt.LeftButton, Qt.NoModifier, places[-1])


def be_the_peer(file: str) -> None:
    """Tick until the standard input ends."""
    app = QGuiApplication(sys.argv[:1])
    watchdog = Watchdog(file, PEER_LIMIT_S)
    asking = QTimer(interval=BEAT_MS, timerType=Qt.PreciseTimer)
    asking.timeout.connect(QCursor.pos)
    asking.start()
    end = QSocketNotifier(sys.stdin.fileno(), QSocketNotifier.Read)
    end.activated.connect(app.quit)
    app.exec_()
    watchdog.close()


def measured(work: Callable[[], None]) -> List[Held]:
    """Return what blocked the window during some work."""
    files = [os.path.join(os.environ['ROS_HOME'], name) for name in ('window', 'peer')]
    peer = subprocess.Popen([sys.executable, __file__, '--peer', files[1]], stdin=subprocess.PIPE)
    watchdog = Watchdog(files[0])
    work()
    watchdog.close()
    peer.communicate()
    return held(*(read_report(file).blocks for file in files))


def step_of(began_s: Dict[str, float], when_s: float) -> str:
    """Return the step that contains a moment."""
    return next((name for name, begin_s in reversed(list(began_s.items())) if begin_s <= when_s),
                'before')


def main() -> int:
    """Print a line for each step; return 1 if the window was blocked for too long."""
    bench = BenchWindow()
    work = Work(bench)
    try:
        found = measured(work.do)
    finally:
        bench.close()
    print('held up longest, ms: the window itself (all, between beats)')
    for step in work.began_s:
        of_step = [it for it in found if step_of(work.began_s, it.until_s) == step]
        longest = max(of_step, key=lambda it: it.own_ms, default=Held(0.0, 0.0, 0.0, ''))
        print(f'{step:>20}: {max(longest.own_ms, 0.0):4.0f} ({longest.lasted_ms:.0f})')
    bad = [it for it in found if it.own_ms > LIMIT_MS]
    for it in bad:
        print(f'\n{step_of(work.began_s, it.until_s)}: {it.own_ms:.0f} ms, the limit is '
              f'{LIMIT_MS:.0f}:\n{it.stack}')
    return 1 if bad else 0


if __name__ == '__main__':
    if sys.argv[1:2] == ['--peer']:
        be_the_peer(sys.argv[2])
    else:
        sys.exit(main())
