# SPDX-License-Identifier: BSD-3-Clause
"""A run: a recording, or a part of one between two events, as numbers over time."""
from __future__ import annotations

import hashlib
from enum import Enum
from typing import Mapping, NamedTuple, Optional, Tuple

import numpy as np

_SELDOM_HZ = 4.0
"""A channel with fewer values per second holds each value until the next."""
Key = Tuple[str, str]
"""A channel: the device and the label."""
Group = Tuple[Tuple[str, Optional[float]], ...]
"""Conditions that determine the expected course of a run, such as its variant, with values."""


class ChannelKind(Enum):
    """The kind of a channel; of two that depart together, the one named first is the cause."""

    VARIABLE = 'variable'
    FORCE = 'force'
    SPEED = 'speed'
    JOINT = 'joint'

    @property
    def is_motion(self) -> bool:
        """Return whether the channel follows from the places of the robot over time."""
        return self in (ChannelKind.SPEED, ChannelKind.JOINT)


class Channel(NamedTuple):
    """Numbers of one quantity: ``times_s`` (n,), ascending, from the run's start, ``values`` (n,).

    ``tolerance`` is how far two good runs may differ, in ``unit``, and ``max_tolerance`` the hard
    limit on the distance from good runs; None if not given. ``value_names`` are the configured
    names of values.
    """

    device: str
    label: str
    unit: str
    kind: ChannelKind
    times_s: np.ndarray
    values: np.ndarray
    tolerance: Optional[float] = None
    value_names: Tuple[Tuple[float, str], ...] = ()
    topic: str = ''
    max_tolerance: Optional[float] = None

    @property
    def key(self) -> Key:
        """Return the key by which the channel is found in another run."""
        return self.device, self.label


class ToolMotion(NamedTuple):
    """A robot tool's path: ``positions`` (n, 3) [m] in the global frame at ``times_s`` (n,)."""

    device: str
    times_s: np.ndarray
    positions: np.ndarray


class ToolForce(NamedTuple):
    """The force or torque at a robot's tool: ``vectors`` (n, 3) [N or Nm] at ``times_s`` (n,).

    ``frame`` is the one that the messages name; empty if they name none.
    """

    device: str
    frame: str
    times_s: np.ndarray
    vectors: np.ndarray


class RunEvent(NamedTuple):
    """A moment of the process in a run [s from the run's start]; a mark is set by an operator."""

    name: str
    time_s: float
    is_mark: bool = False


class RunPhase(NamedTuple):
    """A part of a run between two of its events; a wait may take any time."""

    name: str
    begin: str
    end: str
    is_wait: bool


DAMAGED = 'a part of its recording cannot be read; "cell report" says which'


class Run(NamedTuple):
    """A run; its times count from its start, which is at ``begin_s`` of its recording.

    ``recording`` has the files of the recording in order. ``configuration`` is equal in runs that
    were recorded with the same configuration, and empty if it is unknown. A run that
    ``is_broken_off`` never came to its end. Runs with the same ``group`` are expected to be
    alike; in runs that also have the same ``place``, the tools are expected at the same places.
    ``absent`` says what is configured and was not recorded, and whether that is a mistake. A part
    of a recording that ``is_damaged`` could not be read.
    """

    name: str
    duration_s: float
    channels: Tuple[Channel, ...]
    motions: Tuple[ToolMotion, ...] = ()
    events: Tuple[RunEvent, ...] = ()
    begin_s: float = 0.0
    recording: Tuple[str, ...] = ()
    forces: Tuple[ToolForce, ...] = ()
    configuration: str = ''
    is_broken_off: bool = False
    group: Group = ()
    place: Group = ()
    phases: Tuple[RunPhase, ...] = ()
    absent: Tuple[Tuple[str, bool], ...] = ()
    torques: Tuple[ToolForce, ...] = ()
    is_damaged: bool = False

    @property
    def waits_s(self) -> Tuple[Tuple[float, float], ...]:
        """Return start and end [s] of each phase that may take any time."""
        return tuple(sorted(it for phase in self.phases if phase.is_wait
                            for it in self.between_s(phase.begin, phase.end)))

    def between_s(self, begin: str, end: str) -> Tuple[Tuple[float, float], ...]:
        """Return start and end [s] of each stretch between two events of these names."""
        found = []
        ends = [it.time_s for it in self.events if it.name == end]
        begins = [it.time_s for it in self.events if it.name == begin]
        for begin_s, next_s in zip(begins, [*begins[1:], self.duration_s]):
            end_s = next((it for it in ends if begin_s < it <= next_s), None)
            if end_s is not None:
                found.append((begin_s, end_s))
        return tuple(found)

    @property
    def by_key(self) -> Mapping[Key, Channel]:
        """The channels by device and label."""
        return {channel.key: channel for channel in self.channels}


def fingerprint(run: Run) -> bytes:
    """Return a digest that is equal only for runs whose channels have the same numbers."""
    digest = hashlib.blake2b()
    for channel in run.channels:
        digest.update(repr(channel.key).encode())
        digest.update(np.ascontiguousarray(channel.times_s, float).tobytes())
        digest.update(np.ascontiguousarray(channel.values, float).tobytes())
    return digest.digest()


def part_of(run: Run, begin_s: float, end_s: float, name: str) -> Run:
    """Return the part of a run between two of its times [s]."""
    channels = tuple(_cut_channel(channel, begin_s, end_s) for channel in run.channels)
    motions = tuple(_cut_motion(motion, begin_s, end_s) for motion in run.motions)
    events = tuple(event._replace(time_s=event.time_s - begin_s) for event in run.events
                   if begin_s <= event.time_s <= end_s)
    forces, torques = (tuple(_cut_force(it, begin_s, end_s) for it in vectors)
                       for vectors in (run.forces, run.torques))
    return run._replace(name=name, duration_s=end_s - begin_s, channels=channels, motions=motions,
                        events=events, begin_s=run.begin_s + begin_s, forces=forces,
                        torques=torques)


def _rows(times_s: np.ndarray, begin_s: float, end_s: float) -> slice:
    first, behind = np.searchsorted(times_s, (begin_s, np.nextafter(end_s, np.inf)))
    return slice(int(first), int(behind))


def _cut_channel(channel: Channel, begin_s: float, end_s: float) -> Channel:
    """Cut a channel; if it is rarely sent, keep the value that holds at the start as well.

    This is for channels that are sent only when they change; of a measurement, nothing is known
    before its first message.
    """
    rows = _rows(channel.times_s, begin_s, end_s)
    times_s, values = channel.times_s[rows] - begin_s, channel.values[rows]
    span_s = float(np.ptp(channel.times_s)) if len(channel.times_s) else 0.0
    is_seldom = len(channel.times_s) <= _SELDOM_HZ * span_s + 1.0
    is_whole = not channel.unit and bool((values == np.rint(values)).all())
    if is_seldom and rows.start > 0 and (not len(times_s) or is_whole and times_s[0] > 0.0):
        times_s = np.concatenate(([0.0], times_s))
        values = np.concatenate((channel.values[rows.start - 1:rows.start], values))
    return channel._replace(times_s=times_s, values=values)


def _cut_motion(motion: ToolMotion, begin_s: float, end_s: float) -> ToolMotion:
    rows = _rows(motion.times_s, begin_s, end_s)
    return motion._replace(times_s=motion.times_s[rows] - begin_s,
                           positions=motion.positions[rows])


def _cut_force(force: ToolForce, begin_s: float, end_s: float) -> ToolForce:
    rows = _rows(force.times_s, begin_s, end_s)
    return force._replace(times_s=force.times_s[rows] - begin_s, vectors=force.vectors[rows])
