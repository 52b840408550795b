# SPDX-License-Identifier: BSD-3-Clause
"""Decides the state of a device, its nodes and topics (good, warning, bad), and its short text."""
from __future__ import annotations

from enum import IntEnum
from typing import Collection, Dict, Mapping, NamedTuple, Optional, Sequence, Tuple

from process_visualizer.bagio.catalog import CatalogTopic
from process_visualizer.cell.model import Device, TopicFunction
from process_visualizer.figures import live_rate_text, rate_text
from process_visualizer.health.node_warnings import NodeWarning, Severity, by_node, counted
from process_visualizer.health.topic_silence import TopicActivity
from process_visualizer.launching.part_report import (
    NodeReport,
    NodeState,
    PartReport,
    PartState,
)


class Level(IntEnum):
    """Severity of a state; a higher value needs more attention."""

    OFF = 0
    GOOD = 1
    WAITING = 2
    WARNING = 3
    BAD = 4


class Line(NamedTuple):
    """A state as text; ``short`` replaces a long ``text`` where space is limited.

    ``for_s`` is how long data has been missing [s].
    """

    level: Level
    text: str
    short: str = ''
    for_s: float = 0.0


_OFF, _IDLE = Line(Level.OFF, ''), Line(Level.OFF, 'no nodes in this mode')
_NOT_RESPONDING = Line(Level.BAD, 'not responding')


class DeviceState(NamedTuple):
    """The state of a device, and of its nodes and topics by name.

    ``warnings`` are the present warnings of its nodes.
    """

    summary: Line
    nodes: Dict[str, Line]
    topics: Dict[str, Line]
    warnings: Tuple[NodeWarning, ...] = ()


def device_state(device: Device, report: Optional[PartReport],
                 lines: Mapping[str, Line], warnings: Tuple[NodeWarning, ...] = (),
                 silent: Collection[str] = ()) -> DeviceState:
    """Return the state of a device; ``report`` is None while the device is not running.

    ``lines`` are the states of topics (see ``live_line`` and ``recorded_line``); ``warnings`` may
    include those of other devices. ``silent`` are the nodes of the device that do not answer.
    """
    if report is None or report.state is PartState.STOPPED:
        return DeviceState(_OFF, {}, {topic.name: _OFF for topic in device.topics})
    nodes = {node.name: _warned(_NOT_RESPONDING if node.name in silent
                                and node.state is NodeState.RUNNING else node_line(node),
                                by_node(warnings, {node.name}))
             for node in report.nodes}
    topics = {topic.name: lines.get(topic.name, _OFF) for topic in device.topics}
    own = by_node(warnings, set(nodes))
    if report.state is PartState.RUNNING and not nodes and (device.nodes or device.launch_files):
        return DeviceState(_IDLE, nodes, topics, own)
    summary = _summary(report, topics, own, sorted(silent))
    if summary.level is Level.GOOD and _lacks_joints(device, topics):
        summary = Line(Level.WARNING, 'The recording lacks its joints: its pose is unknown')
    return DeviceState(summary, nodes, topics, own)


def _lacks_joints(device: Device, topics: Mapping[str, Line]) -> bool:
    """Return whether the recording has none of a robot's topics with joints."""
    joints = [it.name for it in device.topics if it.function is TopicFunction.JOINT_STATES]
    return bool(joints) and all(topics[it] == NOT_RECORDED for it in joints)


def node_line(node: NodeReport) -> Line:
    """Return the state of a node."""
    if node.state is NodeState.RUNNING:
        return Line(Level.GOOD, 'running' + _restarts(node))
    if node.state is NodeState.STARTING:
        return Line(Level.WAITING, 'starting' + _restarts(node))
    if node.state is NodeState.EXITED:
        level = Level.BAD if node.exit_code else Level.WARNING
        return Line(level, node.end_words)
    return Line(Level.BAD, f'cannot be started: {node.reason}')


def _warned(line: Line, warnings: Tuple[NodeWarning, ...]) -> Line:
    """Return the state of a node with the number of its warnings."""
    if not warnings or line.level is not Level.GOOD:
        return line
    return Line(_level(warnings), f'{line.text}, {counted(warnings)}')


def _level(warnings: Tuple[NodeWarning, ...]) -> Level:
    is_error = any(it.severity is Severity.ERROR for it in warnings)
    return Level.BAD if is_error else Level.WARNING


def live_line(activity: TopicActivity, is_latched: bool = False) -> Line:
    """Return the state of a topic from its message counts."""
    if activity.silence_s is None:
        return Line(Level.WAITING, 'no message yet')
    if activity.is_silent:
        return Line(Level.WARNING, f'no data for {activity.silence_s:.1f} s',
                    for_s=activity.silence_s)
    return Line(Level.GOOD, live_rate_text(activity.rate_hz, activity.silence_s, is_latched))


NOT_RECORDED = Line(Level.WAITING, 'not in the recording')
"""State of a topic that the recording lacks."""


def recorded_line(topic: CatalogTopic, is_played: bool) -> Line:
    """Return the state of a recorded topic, independently of the playback rate."""
    if not is_played:
        return Line(Level.OFF, 'not played')  # not chosen, or the player reports the reason
    return Line(Level.GOOD, recorded_rate_text(topic))


def recorded_rate_text(topic: CatalogTopic) -> str:
    """Return the rate at which a topic was recorded; a latched topic has none."""
    if topic.is_latched:
        return 'latched'
    return rate_text(topic.rate_hz) if topic.rate_hz > 0.0 else 'once'


def _restarts(node: NodeReport) -> str:
    return f', restarted {node.restarts}×' if node.restarts else ''


def part_line(report: PartReport) -> Line:
    """Return the state of a part as a whole."""
    if report.state in (PartState.STOPPED, PartState.STOPPING):
        return Line(Level.WAITING, report.state.value)
    dead = [node for node in report.nodes if node_line(node).level >= Level.WARNING]
    if dead:
        return _dead(report.part, dead)
    if report.state is PartState.FAILED:
        return Line(Level.BAD, report.reason)
    starting = sum(node.state is NodeState.STARTING for node in report.nodes)
    if report.state is PartState.STARTING or starting:
        return Line(Level.WAITING, f'starting, {len(report.nodes) - starting} of '
                                   f'{len(report.nodes)} nodes up')
    return Line(Level.GOOD, 'running')


def _summary(report: PartReport, topics: Mapping[str, Line],
             warnings: Tuple[NodeWarning, ...], silent: Sequence[str]) -> Line:
    line = part_line(report)
    if line.level is Level.GOOD and silent:
        return _silent(report.part, silent, warnings)
    if line.level is Level.GOOD and warnings:
        count = counted(warnings)
        return Line(_level(warnings), f'{count}: {warnings[0].text}', f'{count}: click to read')
    silent = [name for name, topic in topics.items() if topic.level is Level.WARNING]
    if line.level is Level.GOOD and silent:
        what = silent[0] if len(silent) == 1 else f'{len(silent)} topics'
        return Line(Level.WARNING, f'No data from {what}')
    return line


def _silent(part: str, silent: Sequence[str], warnings: Tuple[NodeWarning, ...]) -> Line:
    """Return silent nodes, then the warnings of other nodes, which are mostly a consequence."""
    text = about_node(part, silent[0], 'not responding', 'is ') + _more(len(silent) - 1)
    if not warnings:
        return Line(Level.BAD, text)
    count = counted(warnings)
    return Line(Level.BAD, f'{text}, {count}: {warnings[0].text}', f'not responding, {count}')


def _dead(part: str, nodes: 'list[NodeReport]') -> Line:
    worst = max(nodes, key=lambda node: node_line(node).level)
    line = node_line(worst)
    return Line(line.level, about_node(part, worst.name, line.text) + _more(len(nodes) - 1))


def about_node(source: str, name: str, text: str, verb: str = '') -> str:
    """Return the text with the node's name, unless node and source have the same name."""
    short = name.rpartition('/')[2]
    return text if short == source else f'{short} {verb}{text}'


def said_of(source: str, text: str, separator: str = ':') -> str:
    """Return source and text; a text that begins with the source is returned unchanged."""
    return text if text.startswith(f'{source} ') else f'{source}{separator} {text}'


def _more(count: int) -> str:
    return f' (and {count} more)' if count else ''


def worst(lines: Tuple[Line, ...]) -> Line:
    """Return the line that needs the most attention."""
    return max(lines, key=lambda line: line.level, default=_OFF)
