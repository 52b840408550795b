# SPDX-License-Identifier: BSD-3-Clause
"""Advice for an operator whose command to the recorder cannot be carried out."""
from __future__ import annotations

from typing import Callable

from process_visualizer.clients.recording_options import (
    RecorderError,
    RecorderUnreachable,
    RecordingOptions,
)
from process_visualizer.gui.models.recording.bag_target import look_at
from process_visualizer.gui.models.recording.recording_types import Phase


def checked(command: Callable[[RecordingOptions], str], options: RecordingOptions) -> str:
    """Run the command if nothing on the disk is in its way; off the GUI thread.

    Raises:
        RecorderError: something is, or the command is refused.
    """
    problem = look_at(options.folder, options.name, options.prefix).problem
    if problem:
        raise RecorderError(problem)
    return command(options)


NOT_RESPONDING = 'The recorder is not responding'
"""It runs, but says nothing at present; no reason to end it."""


def obstacle(phase: Phase, is_silent: bool, options: RecordingOptions, problem: str) -> str:
    """Return why nothing can be recorded, or ''; ``problem`` is that of name and folder."""
    if phase in (Phase.STARTING, Phase.RECORDING, Phase.STOPPING):
        return ''
    if phase in (Phase.OFF, Phase.WAITING):
        return 'nothing to record with: launch the devices in real-time mode first'
    if phase is Phase.GONE:
        return 'the recorder has ended; restart it from its alarm'
    if is_silent:
        return f'{NOT_RESPONDING}. Start when it responds'
    if not options.topics:
        return 'no topic is ticked; open the list of topics and tick what is to be recorded'
    return problem


def repair(path: str) -> str:
    """Return what can be done for a file that the recorder has not finished."""
    return (f'What it wrote is in {path}.active; "rosrun process_visualizer cell reindex '
            f'{path}.active" makes a bag of it')


def advice(error: Exception, path: str) -> str:
    """Return what the operator is told; an error that nobody expects is raised again."""
    if isinstance(error, RecorderUnreachable):
        going_on = f'{path} is still being recorded. ' if path else ''
        return f'{error}. {going_on}Try again when it responds'
    if isinstance(error, (RecorderError, OSError)):
        return str(error)
    raise error
