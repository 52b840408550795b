# SPDX-License-Identifier: BSD-3-Clause
"""A small cell that a live page shows, without ROS: a slide that moves, a number, an alarm."""
from __future__ import annotations

import asyncio
import io
import json
import threading
import time
from pathlib import Path
from typing import Any, Callable, List, Optional

import numpy as np
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage
from tornado.ioloop import IOLoop, PeriodicCallback
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.curves.curve_sources import curve_sources
from process_visualizer.curves.live_curves import LiveCurve, LiveMark, LiveWindow
from process_visualizer.health.node_warnings import Severity
from process_visualizer.msg import DetectedObjects
from process_visualizer.nodes.common.markers import (
    VectorSample,
    text_color,
    text_marker,
    vector_arrow,
)
from process_visualizer.page.html_page import GHOST_STYLE, live_html, web_file
from process_visualizer.page.live_feed import Admission
from process_visualizer.page.live_lanes import STEP_S
from process_visualizer.page.packed import Packed
from process_visualizer.page.run_page import PageCell
from process_visualizer.robot.arrows import ArrowStyle
from process_visualizer.ros_names import LIMIT_KEY
from process_visualizer.runs.comparison.live_comparison import LiveBands
from process_visualizer.runs.comparison.timeline_bands import TimelineBand
from process_visualizer.serving.live_cell import PERIOD_S, LiveCell
from process_visualizer.serving.web_server import LiveServer, served_file

LABEL = '<script>alert(1)</script>heat'
MODEL = '''<robot name="slide"><link name="rail"><visual><origin xyz="0 0 0.1"/><geometry>
<box size="2 0.1 0.2"/></geometry></visual></link><link name="head"><visual><geometry>
<box size="0.3 0.3 0.3"/></geometry></visual></link>
<joint name="x" type="prismatic"><parent link="rail"/><child link="head"/><axis xyz="1 0 0"/>
<origin xyz="0 0 0.4"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint></robot>'''
CELL = f'''<visualizer>
  <device type="robot" name="slide">
    <model path="slide.urdf"/>
    <base frame="rail" xyz="0 0 0"/>
    <tool frame="head"/>
    <topic name="q" type="joint_states" msg="sensor_msgs/JointState"/>
    <topic name="f" type="force_sensor" msg="geometry_msgs/WrenchStamped"/>
    <variable topic="heat" frame="head" axis="0 0 1" unit="K" high="400" scale="0.001"
      label="{LABEL.replace('<', '&lt;')}"/>
  </device>
</visualizer>'''
RED = (0.9, 0.05, 0.05, 1.0)
STYLE = ArrowStyle('F', 'N', 1, 0.01, 0.0, 1.0, 0.02, RED)


def packed(message: Any) -> bytes:
    """A message as it arrives."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


class LiveStand:
    """Serves the cell from a thread of its own; the slide's position depends on the page's time."""

    def __init__(self, folder: Path, port: int = 0) -> None:
        (folder / 'slide.urdf').write_text(MODEL)
        (folder / 'cell.xml').write_text(CELL)
        self.cell = XmlParser().parse(str(folder / 'cell.xml'))
        self._packed = Packed()
        self.shared = PageCell(self.cell, self._packed)
        self.live = LiveCell(self.cell, self.shared, 'stand')
        self.begin_s = time.time() - time.monotonic()
        self.port = port
        self._is_ready, self._run = threading.Event(), threading.Thread(target=self._serve)
        self.note = ''
        self.seen: Optional[DetectedObjects] = None
        self.is_compared = False  # by a launcher, which sends the bands of good runs
        self._live_since_s = time.monotonic()
        self._run.start()
        assert self._is_ready.wait(60.0)

    @property
    def url(self) -> str:
        return f'http://127.0.0.1:{self.port}/'

    def now_s(self) -> float:
        """Return the time of the page."""
        return time.monotonic() + self.begin_s

    def _serve(self) -> None:
        asyncio.run(self._main())

    async def _main(self) -> None:
        self._loop, self._ended = IOLoop.current(), asyncio.Event()
        model = {'meshes': self.shared.meshes, 'ghost': GHOST_STYLE, 'server': 'stand',
                 'columns': self._packed.text()}
        self._files = {
            '': served_file('text/html; charset=utf-8', live_html(f'Cell {LABEL}', ['a note'])),
            'page.js': served_file('text/javascript; charset=utf-8', web_file('page.js')),
            'page.css': served_file('text/css; charset=utf-8', web_file('page.css')),
            'model': served_file('application/json', json.dumps(model))}
        self._open()
        ticks = PeriodicCallback(self._tick, 1000.0 * PERIOD_S)
        ticks.start()
        self._is_ready.set()
        await self._ended.wait()
        ticks.stop()
        self.server.close()

    def _open(self) -> None:
        self.server = LiveServer(self._files, self.live.feed, Admission(''), self.live.recent)
        self.port = self.server.listen('127.0.0.1', self.port, None)

    def do(self, act: Callable[[], None]) -> None:
        """Run a function in the server's thread, and wait for it."""
        done = threading.Event()

        def run() -> None:
            act()
            done.set()
        self._loop.add_callback(run)
        assert done.wait(60.0)

    def cut(self) -> None:
        """Close all connections, and stop listening."""
        self.do(self.server.close)

    def mend(self) -> None:
        """Listen again."""
        self.do(self._open)

    def close(self) -> None:
        self._loop.add_callback(self._ended.set)
        self._run.join()

    @staticmethod
    def place(time_s: float) -> float:
        """Return the head's position [m] at a time of the page."""
        return 0.1 * float(np.sin(time_s))

    def _tick(self) -> None:
        now_s, clock_s = self.now_s(), time.monotonic()
        self._send(now_s, clock_s)
        self._tell(clock_s)
        self.live.tick(now_s, clock_s, len(self.server.viewers))
        self.server.send()

    def _send(self, now_s: float, clock_s: float) -> None:
        for child, xyz, is_static in (('rail', (0.0, 0.0, 0.0), True),
                                      ('head', (self.place(now_s), 0.0, 0.4), False)):
            it = TransformStamped()
            it.header.frame_id, it.child_frame_id = 'rail' if child == 'head' else 'world', child
            it.transform.translation.x, _, it.transform.translation.z = xyz
            it.transform.rotation.w = 1.0
            self.live.take_transforms(packed(TFMessage([it])), is_static)
        self._draw(clock_s, [
            vector_arrow('force', STYLE, VectorSample((0.0, 0.0, 30.0), 'head', 0.0), False),
            text_marker('force', 'head', (0.0, 0.0, 0.2), f'F {self.force(now_s):.1f} N', 0.06,
                        text_color(RED)),
            text_marker(f'variable/{LABEL}', 'head', (0.0, 0.0, 0.2), f'{LABEL} 402 K', 0.06,
                        text_color(RED))])
        self._send_curves(now_s)
        if self.seen is not None:
            self.live.take_objects('camera', self.seen, now_s, clock_s)

    @staticmethod
    def force(time_s: float) -> float:
        """Return the force [N] at a time of the page."""
        return 20.0 + 10.0 * float(np.sin(time_s))

    def _draw(self, clock_s: float, markers: List[Marker]) -> None:
        self.live.take_markers('/slide/marker_array', packed(MarkerArray(markers)), clock_s)

    def _send_curves(self, now_s: float) -> None:
        end = int((now_s - self.epoch_s) / STEP_S) + 1
        times_s = self.epoch_s + np.arange(end - 300, end) * STEP_S
        found = []
        for source in curve_sources(self.cell.devices):
            values = 20.0 + 10.0 * np.sin(times_s)
            found.append(LiveCurve(source, values, values, float(values[-1])))
        self.live.take_curves(LiveWindow((end - 300) * STEP_S, 300 * STEP_S, tuple(found), (
            LiveMark(self._mark_s - self.epoch_s, '</script><b>seam'),), self.epoch_s))
        if self.is_compared:
            self._send_bands(times_s[-30:])

    def _send_bands(self, times_s: np.ndarray) -> None:
        """Send bands with the force inside, or for half a second in each four above."""
        middle, out = 20.0 + 10.0 * np.sin(times_s), times_s % 4.0 < 0.5
        self.live.take_bands(LiveBands(float(times_s[0]), STEP_S, {('slide', 'tool force'):
            TimelineBand(middle - 3.0 - 3.0 * out, middle + 3.0 - 4.0 * out, out)}).text())

    @property
    def epoch_s(self) -> float:
        return self.begin_s + self._live_since_s - 40.0

    @property
    def _mark_s(self) -> float:
        return self.begin_s + self._live_since_s

    def warn(self, text: str) -> None:
        """Let a node report that a variable is beyond its limits."""
        self.live.alarms.warnings.take_state('/slide/variable_proc', 'heat', Severity.ERROR, text,
                                             time.monotonic(), {LIMIT_KEY: 'up to 402 K'})

    def _tell(self, clock_s: float) -> None:
        """Let scene_watch send messages at the slide, as long as there are any."""
        if self.note:
            self.live.take_markers('/scene_watch/marker_array', packed(MarkerArray([
                text_marker('slide', 'head', (0.0, 0.0, -0.1), self.note, 0.1,
                            (1.0, 0.7, 0.1, 1.0))])), clock_s)
