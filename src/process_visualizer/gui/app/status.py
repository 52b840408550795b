# SPDX-License-Identifier: BSD-3-Clause
"""The status line, in the thesis' words (figures 5.2 to 5.4)."""
from __future__ import annotations

from typing import Optional

from process_visualizer.cell.model import Mode
from process_visualizer.gui.models.cell.launch_model import Phase
from process_visualizer.gui.models.recording.recording_model import Phase as RecordingPhase
from process_visualizer.gui.ros.snapshots import PlayerSnapshot
from process_visualizer.health.device_state import Level, Line

_MODE = {Mode.REALTIME: 'In real-time mode.', Mode.PLAYBACK: 'In playback mode.'}
_RECORDING = {RecordingPhase.STARTING: 'Waiting for the topics to record',
              RecordingPhase.RECORDING: 'Recording',
              RecordingPhase.STOPPING: 'Finishing the recording'}


def status_text(phase: Phase, mode: Optional[Mode], activity: str, trouble: Line) -> str:
    """Return the activity of the system; ``mode`` is that of the nodes, ``trouble`` the worst."""
    if phase is Phase.IDLE or mode is None:
        return 'Idle'
    if phase is Phase.LAUNCHING:
        return 'Launching nodes…'
    if phase is Phase.QUITTING:
        return 'Quitting all nodes…'
    text = ' '.join(filter(None, [_MODE[mode], activity]))
    return f'{text}\n{trouble.text}' if trouble.level >= Level.WAITING else text


def recorder_activity(phase: RecordingPhase) -> str:
    """Return the activity of the recorder."""
    return _RECORDING.get(phase, '')


def player_activity(player: Optional[PlayerSnapshot]) -> str:
    """Return the activity of the player."""
    if player is None:
        return ''
    if player.paused:
        return 'Paused'
    direction = '' if player.rate > 0.0 else ' backwards'
    return f'Playing{direction} at {abs(player.rate):g}×'
