# SPDX-License-Identifier: BSD-3-Clause
"""The strip of alarms, and what its buttons do."""
from __future__ import annotations

from typing import Callable

from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.views.cell.alarm_strip import AlarmStrip
from process_visualizer.health.alarm_board import Action, Condition

ShowLog = Callable[[str, str], None]


def alarm_strip(launcher: Launcher, show_log: ShowLog) -> AlarmStrip:
    """Return the strip; ``show_log`` shows the log of a node (its name) of a part."""
    strip = AlarmStrip(launcher.alarms)
    strip.action_wanted.connect(
        lambda action, condition: _carry_out(launcher, show_log, action, condition))
    return strip


def _carry_out(launcher: Launcher, show_log: ShowLog, action: Action,
               condition: Condition) -> None:
    if action is Action.SHOW_LOG:
        show_log(condition.part, condition.node)
    elif action is Action.RESTART_RVIZ:
        launcher.view.restart()
    elif action is Action.GO_THERE:
        launcher.playback.seek(condition.position_s or 0.0)
    elif action is Action.ACKNOWLEDGE:
        launcher.alarms.acknowledge(condition)
    elif action is Action.REPLAY:
        launcher.live.hold(True)  # until the replay is left
        launcher.show_replay(condition.since_s or 0.0)
    else:
        launcher.launch.restart(condition.part)
