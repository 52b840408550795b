# SPDX-License-Identifier: BSD-3-Clause
"""Alarms of a running cell: dead nodes, silent topics, values beyond limits, losses."""
from __future__ import annotations

from typing import Callable, Collection, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple

from process_visualizer.cell.model import Mode
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.plan import BAG_PART, FRAMES_PART, RVIZ_PART
from process_visualizer.health.alarm_board import Action, Condition
from process_visualizer.health.device_state import Level, Line, about_node, node_line
from process_visualizer.health.near_objects import NearObject, ObjectSpans
from process_visualizer.health.node_warnings import NodeWarning
from process_visualizer.launching.cell_watch import CellLook
from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport, PartState
from process_visualizer.ros_names import (
    BAG_PLAYER,
    BAG_RECORDER,
    CONCERNED_KEY,
    CONFLICT_KEY,
    LIMIT_KEY,
    OLD_POINTS_KEY,
    RVIZ,
    SILENT_NODE_KEY,
)


def part_conditions(source: str, report: PartReport, restart: Action) -> List[Condition]:
    """Return the dead nodes of a part, or that it has failed; ``restart`` is what may help.

    A part all of whose nodes have ended normally is stopped, and still missed.
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
    """Return what is wrong with the parts that belong to no device, in the order of their names."""
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
    """Return the remedy for a part that belongs to no device."""
    return Action.RESTART_RVIZ if part == RVIZ_PART else Action.RESTART_PART


def part_titles(mode: Mode) -> Dict[str, str]:
    """Return the names of the parts that belong to no device, for the operator."""
    return {FRAMES_PART: _FRAMES, RVIZ_PART: _RVIZ,
            BAG_PART: _RECORDER if mode is Mode.REALTIME else _PLAYER}


def _end_of_player(node: NodeReport) -> str:
    """Return that the player has stopped, and why, if that is its last message."""
    said = [line for line in node.log_tail if line.startswith(f'{BAG_PLAYER}: ')]
    reason = said[-1][len(BAG_PLAYER) + 2:] if said else ''
    if node.state is not NodeState.EXITED:
        return node_line(node).text
    return f'stopped: {reason}' if reason else f'stopped ({node_line(node).text})'


def _end_of_window(node: NodeReport) -> str:
    """Return how a window has ended, which its own button may have closed."""
    if node.state is not NodeState.EXITED:
        return node_line(node).text
    return 'was closed' if node.exit_code == 0 else _end_of_recorder(node)


def _end_of_recorder(node: NodeReport) -> str:
    """Return how a process has ended that is called by what it does."""
    return 'was killed' if (node.exit_code or 0) < 0 else node_line(node).text


_PLAYER, _RECORDER, _RVIZ = 'Player', 'Recorder', 'RViz'
_FRAMES, _MASTER = 'Frames', 'ROS master'
_SILENT = 'is not responding'
_STATE_KEY = 'for_s'  # of what is on /diagnostics for as long as it lasts
_TRANSIENT_S = 1.0  # while a driver starts
_END_WORDS: Mapping[str, Callable[[NodeReport], str]] = {
    _PLAYER: _end_of_player, _RECORDER: _end_of_recorder, _RVIZ: _end_of_window}


def topic_conditions(device: str, lines: Mapping[str, Line]) -> List[Condition]:
    """Return which topics of a running device send nothing, for how long is told apart."""
    return [Condition(device, name, f'No data from {name}', Level.WARNING,
                      (Action.RESTART_DEVICE,), device, end='data resumed')
            for name, line in lines.items() if line.level is Level.WARNING]


def limit_conditions(device: str, warnings: Iterable[NodeWarning],
                     epoch_s: float) -> List[Condition]:
    """Return which variables of a device are beyond their limits, as its nodes say.

    Args:
        device: its name.
        warnings: of its nodes.
        epoch_s: the time since the epoch at which the clock of warnings was 0.
    """
    return [Condition(device, it.text, f'{it.text}, {it.values[LIMIT_KEY]}', Level.BAD,
                      (Action.REPLAY, Action.ACKNOWLEDGE), since_s=it.since_s + epoch_s,
                      is_latched=True, told_by=(it.node, it.text))
            for it in warnings if LIMIT_KEY in it.values]


def conflict_conditions(device: str, warnings: Iterable[NodeWarning]) -> List[Condition]:
    """Return on which topics of a device nodes contradict each other, as its nodes say."""
    return [Condition(device, f'sources of {it.node}', it.values[CONFLICT_KEY], Level.BAD)
            for it in warnings if CONFLICT_KEY in it.values]


def message_conditions(device: str, warnings: Iterable[NodeWarning],
                       now_s: float) -> List[Condition]:
    """Return which messages of a device its nodes leave out or doubt, for some time already.

    What several nodes say in the same words is said once.

    Args:
        device: its name.
        warnings: of its nodes.
        now_s: the time of their clock.
    """
    found: Dict[str, Condition] = {}
    for it in warnings:
        if it.count and _STATE_KEY in it.values and CONFLICT_KEY not in it.values \
                and now_s - it.since_s >= _TRANSIENT_S:
            found.setdefault(it.text, Condition(device, it.about, it.text, Level.WARNING))
    return list(found.values())


def silence_conditions(warnings: Iterable[NodeWarning]) -> List[Condition]:
    """Return which nodes do not answer, as the nodes say that ask all others."""
    found: Dict[str, Condition] = {}
    for it in warnings:
        node = it.values.get(SILENT_NODE_KEY)
        if node is not None:
            device = it.values.get(CONCERNED_KEY, '')
            actions = (Action.RESTART_DEVICE,) if device else (Action.RESTART_PART,)
            found.setdefault(node, Condition(device or _FRAMES, node, it.text, Level.BAD, actions,
                                             device or FRAMES_PART, node))
    return list(found.values())


def cloud_conditions(device: str, warnings: Iterable[NodeWarning]) -> List[Condition]:
    """Return that no cloud of a device comes, as the node says that watches the scene."""
    return [Condition(device, 'points', it.text, Level.WARNING, (Action.RESTART_DEVICE,), device,
                      end='clouds come again')
            for it in warnings if it.values.get(OLD_POINTS_KEY) == device]


def watch_conditions(mode: Mode, look: CellLook, parts: Mapping[str, str],
                     told: Iterable[Condition] = ()) -> List[Condition]:
    """Return which nodes do not answer the program that has launched them, or the master.

    Args:
        mode: what runs.
        look: what was found.
        parts: the part of the cell that a node belongs to, by its name.
        told: what the nodes themselves say of that, with what it means: nothing is said twice.
    """
    said, titles = {it.node for it in told}, part_titles(mode)
    found: List[Condition] = []
    if look.master:
        found.append(Condition(_MASTER, look.master, look.master, Level.BAD, is_clause=True))
    for name in sorted(look.silent - said):
        part = parts.get(name, FRAMES_PART)
        source = titles.get(part, part)
        is_alone = part in (RVIZ_PART, BAG_PART)
        action = own_restart(part) if part in titles else Action.RESTART_DEVICE
        text = _SILENT if is_alone else about_node(source, name, _SILENT)
        found.append(Condition(source, name, text, Level.BAD, (action, Action.SHOW_LOG), part, name,
                               is_clause=text is _SILENT))
    return found


def part_of_node(name: str, choice: Choice) -> str:
    """Return the part of the cell to which a launched node belongs: a device, or one of ours."""
    own = {f'/{BAG_RECORDER}': BAG_PART, f'/{BAG_PLAYER}': BAG_PART, f'/{RVIZ}': RVIZ_PART}
    space = name.split('/')[1]
    is_device = any(device.name == space for device in choice.devices)
    return own.get(name, space if is_device else FRAMES_PART)


def object_conditions(device: str, near: Iterable[NearObject],
                      played: Optional[ObjectSpans] = None) -> List[Condition]:
    """Return which unmodeled objects a sensor sees near a robot.

    Args:
        device: the sensor's name.
        near: what it sees, since when [s since the epoch].
        played: where in a recording that began; None if it is the running cell.
    """
    found = []
    for it in near:
        number = it.seen.number
        condition = Condition(device, f'object {number}', f'object {number} is {it.seen.place()}',
                              it.level, (Action.REPLAY,), since_s=it.since_s,
                              told_by=(device,))
        if played is not None:
            begun_s = played.begun_s(device, number)
            if begun_s is None:
                continue
            condition = condition._replace(actions=(Action.GO_THERE,), position_s=begun_s)
        found.append(condition)
    return found


def blind_condition(device: str, since_s: float) -> Condition:
    """Return that a sensor [device] cannot see: a clear cell must not look the same."""
    return Condition(device, 'objects', 'no objects can be found: none of its clouds is evaluated',
                     Level.WARNING, since_s=since_s)


def departure_conditions(departed: Iterable[Tuple[str, str, str, float]]) -> List[Condition]:
    """Return which channels are out of the band of good runs.

    Args:
        departed: device, label, how far out, and since when [s since the epoch], of each.
    """
    return [Condition(device, f'{label} out of the band', f'{label} {text}', Level.WARNING,
                      since_s=since_s, told_by=(device, label), name=f'{label} out of range')
            for device, label, text, since_s in departed]


DATA_ENDED, QUIT = 'the data ended', 'the nodes were quit'


def end_words(condition: Condition, lost: Collection[Tuple[str, ...]]) -> str:
    """Return what is to be said of a condition that has ended while the cell runs.

    ``lost`` are values that come no longer: it is not known whether what they told of is over.
    """
    return DATA_ENDED if condition.told_by and condition.told_by in lost else condition.end


def loss_conditions(is_recording: bool, dropped: int, lost: int) -> List[Condition]:
    """Return how many messages a recording lacks."""
    words = [f'{count} {what}' for count, what in ((dropped, 'dropped'), (lost, 'lost')) if count]
    if not is_recording or not words:
        return []
    return [Condition('recording', 'losses', f'messages are missing: {", ".join(words)}',
                      Level.WARNING, end='still missing when the recording ended,')]


def recorded_conditions(alarms: Sequence[Tuple[str, str, float, float]],
                        position_s: float) -> List[Condition]:
    """Return the alarms of a recording at a position [s]: device, text, begin and end [s] each."""
    return [Condition(device, text, text, Level.BAD, (Action.GO_THERE,), position_s=begin_s)
            for device, text, begin_s, end_s in alarms if begin_s <= position_s <= end_s]
