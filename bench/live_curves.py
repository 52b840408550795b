# SPDX-License-Identifier: BSD-3-Clause
"""Cost of the live curves: 20 variables at 125 Hz, a real recorder, the panel on a screen.

usage: bench/run live_curves
"""
from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, List, Tuple, cast
from unittest.mock import Mock

import rospy
from PyQt5.QtCore import QEventLoop, QTimer
from PyQt5.QtWidgets import QApplication
from roslib.packages import find_node

from process_visualizer.cell.model import Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.clients.bag_recorder import RecorderMemory
from process_visualizer.generate.choice import Choice
from process_visualizer.gui.app.main import make_application
from process_visualizer.gui.compare.compare_model import CompareModel
from process_visualizer.gui.compare.live_comparison_model import LiveComparisonModel
from process_visualizer.gui.lanes.lane_choice import LaneChoices
from process_visualizer.gui.live.live_curves_model import DURATIONS_S, LiveCurvesModel
from process_visualizer.gui.live.live_panel import LivePanel
from process_visualizer.gui.live.replay_model import ReplayModel
from process_visualizer.gui.playback.playback_model import PlaybackModel
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks

CHANNELS, RATE_HZ = 20, 125.0
MEASURED_S, SETTLE_S = 20.0, 35.0
PUBLISHER = f'''
import math, rospy
from std_msgs.msg import Float32
rospy.init_node('variables')
publishers = [rospy.Publisher(f'/value_{{n}}', Float32, queue_size=10) for n in range({CHANNELS})]
rate, count = rospy.Rate({RATE_HZ}), 0
while not rospy.is_shutdown():
    count += 1
    for n, publisher in enumerate(publishers):
        publisher.publish(math.sin(count * 0.002 * (n + 1)) + 0.05 * math.sin(count * 7.1 * n))
    rate.sleep()
'''


def configuration(folder: Path) -> str:
    variables = ''.join(
        f'<topic name="value_{n}"/><variable topic="value_{n}" frame="world" label="value {n}" '
        'unit="N"/>' for n in range(CHANNELS))
    path = folder / 'cell.xml'
    path.write_text(f'<visualizer><device type="other" name="machine">{variables}</device>'
                    '</visualizer>', encoding='utf-8')
    return str(path)


def pause(seconds: float) -> None:
    loop = QEventLoop()
    QTimer.singleShot(round(1000 * seconds), loop.quit)
    loop.exec_()


def processor_s() -> float:
    user, system, *_ = os.times()
    return user + system


def share(seconds: float) -> float:
    """Return the share of a core that this process takes."""
    before, begin_s = processor_s(), time.monotonic()
    pause(seconds)
    return (processor_s() - before) / (time.monotonic() - begin_s)


def measured(panel: LivePanel, model: LiveCurvesModel) -> List[Tuple[str, float]]:
    rows = []
    for duration_s in DURATIONS_S:
        model.set_duration(duration_s)
        pause(2.0)
        assert model.window is not None and len(model.window.curves) == CHANNELS
        rows.append((f'{duration_s:.0f} s shown', share(MEASURED_S)))
    panel.hide()
    pause(1.0)
    rows.append(('hidden', share(MEASURED_S)))
    return rows


def main() -> None:
    """Print a table."""
    app: QApplication = make_application()
    core = subprocess.Popen(['roscore', '-p', os.environ['ROS_MASTER_URI'].rsplit(':', 1)[1]],
                            stdout=subprocess.DEVNULL)
    time.sleep(4.0)
    rospy.init_node('bench', disable_signals=True)
    rospy.set_param('/bag_recorder/topics', [f'/value_{n}' for n in range(CHANNELS)])
    children = [core, subprocess.Popen([sys.executable, '-c', PUBLISHER]), subprocess.Popen(
        [find_node('process_visualizer', 'bag_recorder')[0], '__name:=bag_recorder'])]
    tasks = Tasks()
    try:
        with tempfile.TemporaryDirectory() as folder:
            cell = XmlParser().parse(configuration(Path(folder)))
        session = Session()
        model = LiveCurvesModel(tasks, RecorderMemory(), session)
        replay = ReplayModel(tasks, PlaybackModel(tasks, cast(Any, Mock())), cast(Any, Mock()), (),
                             session)
        panel = LivePanel(model, LaneChoices(), replay,
                          LiveComparisonModel(CompareModel(tasks, session), model))
        panel.resize(1500, 900)
        panel.show()
        session.set_cell(cell, cell.devices)
        session.set_run(Choice(cell, Mode.REALTIME, cell.devices), True, {})
        pause(SETTLE_S)
        print('| live curves, 20 variables at 125 Hz | of a core |\n|---|---|')
        for name, part in measured(panel, model):
            print(f'| {name} | {part:.1%} |', flush=True)
        app.processEvents()
    finally:
        tasks.close()
        for child in reversed(children):
            child.terminate()
            child.wait(10.0)


if __name__ == '__main__':
    main()
