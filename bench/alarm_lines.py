# SPDX-License-Identifier: BSD-3-Clause
"""The launcher without its window: launches a cell, and writes each event of the alarm strip.

usage: python3 bench/alarm_lines.py CONFIG    (in the environment of the workspace, with a screen)

Programs of bench/ read its lines. At the end of its input, it ends everything it has launched.
"""
from __future__ import annotations

import os
import sys

from PyQt5.QtCore import QSocketNotifier

from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.app.main import make_application


def main() -> None:
    """Launch, and print events until the input ends."""
    os.environ['XDG_CONFIG_HOME'] = os.environ['ROS_HOME']
    app = make_application()
    launcher = Launcher(app)
    told = 0

    def tell() -> None:
        nonlocal told
        events = launcher.alarms.events
        for event in events[told:]:
            print(f'event: {event.text}', flush=True)
        told = len(events)

    def tell_state() -> None:
        print(f'nodes: {launcher.launch.phase.value}; {launcher.status()}'.replace('\n', ' '),
              flush=True)

    launcher.alarms.happened.connect(tell)
    launcher.launch.changed.connect(tell_state)
    launcher.failed.connect(lambda text: print(f'message: {text}', flush=True))
    notifier = QSocketNotifier(sys.stdin.fileno(), QSocketNotifier.Read)
    notifier.activated.connect(app.quit)
    launcher.begin()
    launcher.cell.open(sys.argv[1])
    launcher.when_ready(None, True)
    app.exec_()
    launcher.close()


if __name__ == '__main__':
    main()
