# SPDX-License-Identifier: BSD-3-Clause
"""Turns the reports of nodes, topics and variables into alarm conditions, with their texts."""
from __future__ import annotations

import math
from typing import Callable, Collection, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple

from process_visualizer.cell.model import Mode
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.plan import BAG_PART, FRAMES_PART, RVIZ_PART
from process_visualizer.health.alarm_board import Action, Condition
from process_visualizer.health.device_state import Level, Line, about_node, node_line
from process_visualizer.health.near_objects import NearObject, ObjectSpans
from process_visualizer.health.node_warnings import NodeWarning
from process_visualizer.launching.cell_watch import MASTER_OTHER, MASTER_SILENT, CellLook
from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport, PartState
from process_visualizer.ros_names import (
    BAG_PLAYER,
    BAG_RECORDER,
    CONCERNED_KEY,
    CONFLICT_KEY,
    EXCESS_KEY,
    LIMIT_KEY,
    RVIZ,
    SILENT_NODE_KEY,
    STALE_POINTS_KEY,
    TIMES_KEY,
)


def part_conditions(source: str, report: PartReport, restart: Action) -> List[Condition]:
    """Return the conditions of a part: its dead nodes, or its failure.

    A part whose nodes have all ended normally has stopped, but still counts as missing. ``restart``
    is the remedy offered.
    """
    if report.state is PartState.STOPPING:
        return []
    actions = restart, Action.SHOW_LOG
    dead = [(node.name, node_line(node)) for node in report.nodes
            if node_line(node).level >= Level.WARNING]
    if not dead and report.state is PartState.FAILED:
        return [Condition(source, report.part, report.reason, Level.BAD, actions, report.part)]
    return [Condition(source, name, about_node(source, name, line.text), line.level,
                      actions, report.part, name) for name, line in dead]


def own_part_conditions(mode: Mode, reports: Mapping[str, PartReport]) -> List[Condition]:
    """Return the conditions of the parts without a device, in the order of ``part_titles``."""
    found: List[Condition] = []
    for part, title in part_titles(mode).items():
        report = reports.get(part)
        ends = {} if report is None else {node.name: node for node in report.nodes}
        for it in [] if report is None else part_conditions(title, report, own_restart(part)):
            words = _END_WORDS.get(title)
            if words is not None and it.node:
                it = it._replace(text=words(ends[it.node]), is_clause=True)
            found.append(it)
    return found


def own_restart(part: str) -> Action:
    """Return the remedy for a part without a device."""
    return Action.RESTART_RVIZ if part == RVIZ_PART else Action.RESTART_PART


def part_titles(mode: Mode) -> Dict[str, str]:
    """Return the names of the parts without a device, as shown to the operator."""
    return {FRAMES_PART: _FRAMES, RVIZ_PART: _RVIZ,
            BAG_PART: _RECORDER if mode is Mode.REALTIME else _PLAYER}


def _end_of_player(node: NodeReport) -> str:
    """Return a text about the end of the player, with the reason from its last log line, if any."""
    said = [line for line in node.log_tail if line.startswith(f'{BAG_PLAYER}: ')]
    reason = said[-1][len(BAG_PLAYER) + 2:] if said else ''
    if node.state is not NodeState.EXITED:
        return node_line(node).text
    return f'stopped: {reason}' if reason else f'stopped ({node_line(node).text})'


def _end_of_window(node: NodeReport) -> str:
    """Return a text about the end of a window, which the user may have closed."""
    if node.state is not NodeState.EXITED:
        return node_line(node).text
    return 'was closed' if node.exit_code == 0 and not node.reason else _end_of_recorder(node)


def _end_of_recorder(node: NodeReport) -> str:
    """Return a text about the end of a process that is named after its purpose."""
    return 'was killed' if (node.exit_code or 0) < 0 else node_line(node).text


_PLAYER, _RECORDER, _RVIZ = 'Player', 'Recorder', 'RViz'
_FRAMES, MASTER = 'Frames', 'ROS master'
_SILENT = 'is not responding'
_STATE_KEY = 'for_s'  # key of states, which are on /diagnostics while they last
_TRANSIENT_S = 1.0  # warnings of a starting driver last for less
_END_WORDS: Mapping[str, Callable[[NodeReport], str]] = {
    _PLAYER: _end_of_player, _RECORDER: _end_of_recorder, _RVIZ: _end_of_window}


def topic_conditions(device: str, lines: Mapping[str, Line], now_s: float) -> List[Condition]:
    """Return a condition for each silent topic of a running device; its text has no duration.

    ``now_s`` is the time since the epoch [s]; a silence begins with the last message before it.
    """
    return [Condition(device, name, f'No data from {name}', Level.WARNING,
                      (Action.RESTART_DEVICE,), device, since_s=now_s - line.for_s,
                      end='data resumed')
            for name, line in lines.items() if line.level is Level.WARNING]


def limit_conditions(device: str, warnings: Iterable[NodeWarning],
                     epoch_s: float) -> List[Condition]:
    """Return a condition for each variable beyond its limits, as the device's nodes report.

    Args:
        device: the device's name.
        warnings: those of its nodes.
        epoch_s: time since the epoch at which the clock of the warnings was 0.
    """
    return [Condition(device, it.text, f'{it.text}, {it.values[LIMIT_KEY]}', Level.BAD,
                      (Action.REPLAY, Action.ACKNOWLEDGE), since_s=it.since_s + epoch_s,
                      is_latched=True, reported_by=(it.node, it.text),
                      excess=_number(it.values.get(EXCESS_KEY, '')),
                      times=int(_number(it.values.get(TIMES_KEY, ''))))
            for it in warnings if LIMIT_KEY in it.values]


def _number(text: str) -> float:
    """Return a number from a text that any node may have sent; 0 if it is not a number."""
    try:
        number = float(text)
    except ValueError:
        return 0.0
    return number if math.isfinite(number) else 0.0


def conflict_conditions(device: str, warnings: Iterable[NodeWarning]) -> List[Condition]:
    """Return a condition for each contradiction between sources, as the device's nodes report."""
    return [Condition(device, f'sources of {it.node}', it.values[CONFLICT_KEY], Level.BAD)
            for it in warnings if CONFLICT_KEY in it.values]


def message_conditions(device: str, warnings: Iterable[NodeWarning],
                       now_s: float) -> List[Condition]:
    """Return conditions for messages that a device's nodes have skipped or doubted for some time.

    Warnings with the same text become one condition.

    Args:
        device: the device's name.
        warnings: those of its nodes.
        now_s: present time of the clock of the warnings.
    """
    found: Dict[str, Condition] = {}
    for it in warnings:
        if it.count and _STATE_KEY in it.values and CONFLICT_KEY not in it.values \
                and now_s - it.since_s >= _TRANSIENT_S:
            found.setdefault(it.text, Condition(device, it.about, it.text, Level.WARNING))
    return list(found.values())


def silence_conditions(warnings: Iterable[NodeWarning], epoch_s: float) -> List[Condition]:
    """Return a condition for each silent node, as reported by the nodes that watch all others.

    ``epoch_s`` is the time since the epoch [s] at which the clock of the warnings was 0.
    """
    found: Dict[str, Condition] = {}
    for it in warnings:
        node = it.values.get(SILENT_NODE_KEY)
        if node is not None:
            device = it.values.get(CONCERNED_KEY, '')
            actions = (Action.RESTART_DEVICE,) if device else (Action.RESTART_PART,)
            found.setdefault(node, Condition(device or _FRAMES, node, it.text, Level.BAD, actions,
                                             device or FRAMES_PART, node,
                                             since_s=it.since_s + epoch_s))
    return list(found.values())


def cloud_conditions(device: str, warnings: Iterable[NodeWarning],
                     epoch_s: float) -> List[Condition]:
    """Return a condition if a device's clouds are missing, as the node scene_watch reports.

    It begins with the last cloud. ``epoch_s`` is the time since the epoch [s] at which the clock
    of the warnings was 0.
    """
    return [Condition(device, 'points', it.text, Level.WARNING, (Action.RESTART_DEVICE,), device,
                      since_s=it.since_s + epoch_s, end='clouds are arriving again')
            for it in warnings if it.values.get(STALE_POINTS_KEY) == device]


def watch_conditions(mode: Mode, look: CellLook, parts: Mapping[str, str],
                     reported: Iterable[Condition] = (), epoch_s: float = 0.0) -> List[Condition]:
    """Return conditions for nodes, and the master, that do not answer this program.

    Args:
        mode: the mode of the running cell.
        look: result of asking nodes and master.
        parts: the part of the cell to which a node belongs, by the node's name.
        reported: conditions that nodes have already reported; these nodes are not reported again.
        epoch_s: time of the alarms' clock at which the monotonic clock was 0.
    """
    already_reported, titles = {it.node for it in reported}, part_titles(mode)
    found: List[Condition] = []
    if look.master_problem:
        found.append(Condition(MASTER, look.master_problem, look.master_problem, Level.BAD,
                               is_clause=True))
    for name in sorted(look.silent - already_reported):
        part = parts.get(name, FRAMES_PART)
        source = titles.get(part, part)
        is_alone = part in (RVIZ_PART, BAG_PART)
        action = own_restart(part) if part in titles else Action.RESTART_DEVICE
        text = _SILENT if is_alone else about_node(source, name, _SILENT)
        found.append(Condition(source, name, text, Level.BAD, (action, Action.SHOW_LOG), part, name,
                               since_s=look.since_s[name] + epoch_s if name in look.since_s
                               else None, is_clause=text == _SILENT))
    return found


def lost_master(is_other: bool) -> Condition:
    """Return the condition of a master that is lost while no cell runs.

    It is the same alarm as that of ``watch_conditions``. ``is_other`` is set if another master
    answers.
    """
    text = 'was restarted' if is_other else _SILENT
    return Condition(MASTER, MASTER_OTHER if is_other else MASTER_SILENT,
                     f'{text}; restart the launcher ("Launch nodes" offers this)', Level.BAD,
                     is_clause=True)


def part_of_node(name: str, choice: Choice) -> str:
    """Return the part of the cell to which a launched node belongs: a device, or one of our own."""
    own = {f'/{BAG_RECORDER}': BAG_PART, f'/{BAG_PLAYER}': BAG_PART, f'/{RVIZ}': RVIZ_PART}
    space = name.split('/')[1]
    is_device = any(device.name == space for device in choice.devices)
    return own.get(name, space if is_device else FRAMES_PART)


def object_conditions(device: str, near: Iterable[NearObject],
                      played: Optional[ObjectSpans] = None) -> List[Condition]:
    """Return a condition for each unmodeled object that a sensor sees near a robot.

    Args:
        device: the sensor's name.
        near: the objects, with the times at which they came near [s since the epoch].
        played: the spans in a recording; None for the running cell.
    """
    found = []
    for it in near:
        number = it.seen.number
        condition = Condition(device, f'object {number}', f'object {number} is {it.seen.place()}',
                              it.level, (Action.REPLAY,), since_s=it.since_s,
                              reported_by=(device,))
        if played is not None:
            begun_s = played.begun_s(device, number)
            if begun_s is None:
                continue
            condition = condition._replace(actions=(Action.GO_THERE,), position_s=begun_s)
        found.append(condition)
    return found


def blind_condition(device: str, since_s: float) -> Condition:
    """Return the condition of a sensor without data, which must not look like a clear cell."""
    return Condition(device, 'objects', 'no objects can be found: none of its clouds is evaluated',
                     Level.WARNING, since_s=since_s)


def departure_conditions(departed: Iterable[Tuple[str, str, str, float]]) -> List[Condition]:
    """Return a condition for each channel outside the band of good runs.

    Args:
        departed: device, label, distance to the band in words, and start [s since the epoch], each.
    """
    return [Condition(device, f'{label} out of the band', f'{label} {text}', Level.WARNING,
                      (Action.REPLAY,), since_s=since_s, reported_by=(device, label),
                      name=f'{label} out of range')
            for device, label, text, since_s in departed]


NO_DATA, QUIT = 'no data', 'the nodes were quit'


def end_words(condition: Condition, lost: Collection[Tuple[str, ...]]) -> str:
    """Return a text for the end of a condition while the cell runs.

    ``lost`` are values that no longer arrive: whether their conditions persist is unknown.
    """
    return NO_DATA if condition.reported_by and condition.reported_by in lost else condition.end


def loss_conditions(is_recording: bool, dropped: int, lost: int) -> List[Condition]:
    """Return a condition with the number of messages missing from a recording, if any."""
    words = [f'{count} {what}' for count, what in ((dropped, 'dropped'), (lost, 'lost')) if count]
    if not is_recording or not words:
        return []
    return [Condition('recording', 'losses', f'messages are missing: {", ".join(words)}',
                      Level.WARNING, end='not recovered before the recording ended,')]


def recorded_conditions(alarms: Sequence[Tuple[str, str, float, float]],
                        position_s: float) -> List[Condition]:
    """Return conditions for the alarms (device, text, start, end [s]) present at a position [s]."""
    return [Condition(device, text, text, Level.BAD, (Action.GO_THERE,), position_s=begin_s)
            for device, text, begin_s, end_s in alarms if begin_s <= position_s <= end_s]
