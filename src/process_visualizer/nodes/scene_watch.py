# SPDX-License-Identifier: BSD-3-Clause
"""Shows in the scene which devices are out of date, because a process has ended or hangs.

Markers of data disappear by themselves if they are not redrawn (``markers.LIFETIME_S``). A robot
that no longer moves, or a cloud, stays in the picture: only a text can show that it is out of date.
So every process that draws is asked a few times a second whether it is alive.
"""
from __future__ import annotations

import sys
from functools import partial
from typing import Dict, List, Mapping, Set, Tuple

import rosgraph
import rospy
from std_msgs.msg import Float32
from visualization_msgs.msg import MarkerArray

from process_visualizer.health.node_pulse import (
    ENDED,
    SILENT,
    Connect,
    MasterLookup,
    Pulses,
    connecting,
)
from process_visualizer.launching.ros_api import Master, MasterClient
from process_visualizer.nodes.common.complaints import Complaints, SilentNode, SilentNodes
from process_visualizer.nodes.common.markers import RefreshRate, invisible_marker, text_marker
from process_visualizer.nodes.common.node_handle import NodeHandle, start_node
from process_visualizer.nodes.common.node_parameters import private_parameters
from process_visualizer.parameters.cell_parameters import SceneParameters, WatchedDevice
from process_visualizer.parameters.reading import ParameterError
from process_visualizer.ros_names import (
    CELL_FRAMES,
    GHOST,
    SCENE_WATCH,
    SENSOR_FIT,
    STALE_POINTS_KEY,
)

TEXT_PERIOD_S = 0.2
CALM_PERIOD_S = 1.0  # so that RViz has something to show, even if the frames arrive later
LOOKUP_PERIOD_S = 2.0
LOG_PERIOD_S = 10.0
ALARM_AGE_S = 2.0
"""Age of a cloud that raises an alarm [s]; a smaller delay is only noted in the scene."""
SEEN = '~seen'
ITSELF = 'the cell'
ABOVE_ALL_M = (0.0, 0.0, 1.2)
OWN_NODES = {
    f'/{CELL_FRAMES}': 'no frame can be moved', f'/{SENSOR_FIT}': 'no sensor can be placed',
    f'/{GHOST}': 'the reference run is out of date'}
"""The program's own nodes, except player and recorder (not always there), and the effect of losing
each."""
_AGE_HOLDS_S = 1.0
AMBER = (1.0, 0.7, 0.1, 1.0)
HEIGHT_M = 0.06
NO_CLOUD = 'no cloud is arriving; the points in the picture are out of date'
OTHERS_MEANING = 'this picture is out of date'
ROBOTS_STAND = f'{ITSELF}: the ROS master is not responding; robots may freeze'
"""robot_state_publisher 1.15 asks the master for tf_prefix with each joint state."""


class SceneWatch:
    """Asks the nodes of all devices whether they are alive, and shows the problems."""

    def __init__(self, node: NodeHandle, master: Master, parameters: SceneParameters,
                 connect: Connect = connecting) -> None:
        """Advertise, and subscribe to the ages of clouds; see `Pulses` for ``connect``."""
        self._node, self._master = node, master
        self._frame = parameters.frame
        self._devices = (*parameters.devices, WatchedDevice(
            ITSELF, parameters.frame, ABOVE_ALL_M, OWN_NODES, ()))
        self._silent = SilentNodes(node)
        self._clouds = Complaints(node, node.name.strip('/'))
        self._stale_after_s = parameters.stale_after_s
        self._lookup = MasterLookup(master)
        self._pulses = Pulses(self._lookup, connect)
        self._meanings: Dict[str, Dict[str, str]] = {
            device.name: dict(device.nodes) for device in self._devices}
        self._others: Dict[str, Set[str]] = {}  # the topics of publishers that are not ours
        self._beside: Dict[str, Set[str]] = {}  # publishers of the same topics while they ran
        self._replaced: Set[str] = set()  # ended ones whose topics have new publishers
        self._ages: Dict[str, Tuple[float, float]] = {}  # age [s], and when it was reported
        self._texts, self._calm = RefreshRate(TEXT_PERIOD_S), RefreshRate(CALM_PERIOD_S)
        self._lookups, self._log = RefreshRate(LOOKUP_PERIOD_S), RefreshRate(LOG_PERIOD_S)
        seen = node.param(SEEN, [])  # set by this node's last process, or by another program
        self._seen = frozenset(map(str, seen if isinstance(seen, list) else ()))
        known = {name for meanings in self._meanings.values() for name in meanings}
        self._pulses.watch(self._seen & known, are_expected=True)
        self._publisher = node.publisher('~marker_array', MarkerArray, queue_size=1, latch=True)
        for device in self._devices:
            if device.age_topic:
                node.subscribe(device.age_topic, Float32, partial(self._on_age, device.name))

    def run(self) -> None:
        """Watch until ROS shuts the node down."""
        while not self._node.is_shutdown():
            self.step(TEXT_PERIOD_S)

    def step(self, longest_s: float) -> None:
        """Ask, wait for answers for a limited time [s], and publish if that is due."""
        now_s = self._node.monotonic_s()
        if self._lookups.is_due(now_s):
            self._look_up_publishers()
        self._pulses.step(now_s, longest_s)
        self._remember()
        self._silent.tell(self._silent_nodes())
        self._report_stale_points()
        problems = self.problems()
        if (self._texts if problems else self._calm).is_due(now_s):
            self._publish(problems)

    def _silent_nodes(self) -> Dict[str, SilentNode]:
        """Return the nodes that hang; the program that started the nodes knows which have ended."""
        devices = {device.name for device in self._devices} - {ITSELF}
        pulses = self._pulses.nodes
        return {name: SilentNode(device if device in devices else '', meaning,
                                 pulses[name].problem_since_s)
                for device, meanings in self._meanings.items()
                for name, meaning in meanings.items()
                if name in pulses and pulses[name].problem == SILENT}

    def _report_stale_points(self) -> None:
        """Report the clouds that do not arrive; a cloud without a reported age keeps its state."""
        now_s = self._node.monotonic_s()
        for device, (age_s, reported_s) in tuple(self._ages.items()):  # other threads add to it
            if now_s - reported_s >= _AGE_HOLDS_S:
                continue
            if age_s > max(self._stale_after_s, ALARM_AGE_S):
                self._clouds.state(f'points of {device}', NO_CLOUD, {STALE_POINTS_KEY: device},
                                   LOG_PERIOD_S, since_s=reported_s - age_s)
            else:
                self._clouds.end(f'points of {device}')

    def _remember(self) -> None:
        """Save the names of nodes that have answered, for the next process of this node.

        Otherwise a node that ends before that process starts would never be reported.
        """
        answered = {name for name, node in self._pulses.nodes.items() if node.has_answered}
        if answered <= self._seen or self._lookup.is_silent:
            return
        try:
            self._master.setParam(self._node.resolve(SEEN), sorted(self._seen | answered))
            self._seen |= answered
        except (rosgraph.MasterException, OSError):
            self._lookup.is_silent = True  # try again later

    def problems(self) -> Dict[str, List[str]]:
        """Return the present problems by device name."""
        found = {device.name: self._problems(device.name) for device in self._devices}
        if self._lookup.is_silent:
            found[ITSELF].append(ROBOTS_STAND)
        return {name: problems for name, problems in found.items() if problems}

    def _problems(self, device: str) -> List[str]:
        ended = [(name, self._pulses.nodes[name].problem) for name in self._meanings[device]
                 if name in self._pulses.nodes and name not in self._replaced]
        lines = [f'{device}: {name.split("/")[-1]} {problem}; {self._meanings[device][name]}'
                 for name, problem in ended if problem]
        age_s, reported_s = self._ages.get(device, (0.0, 0.0))
        if age_s > self._stale_after_s and self._node.monotonic_s() - reported_s < _AGE_HOLDS_S:
            lines.append(f'{device}: points {age_s:.1f} s old')
        return lines

    def _publish(self, problems: Mapping[str, List[str]]) -> None:
        self._publisher.publish(MarkerArray([invisible_marker('all is well', self._frame), *(
            text_marker(device.name, device.frame, device.position,
                        '\n'.join(problems[device.name]), HEIGHT_M, AMBER)
            for device in self._devices if device.name in problems)]))

    def _look_up_publishers(self) -> None:
        """Watch the publishers of displayed topics, besides the known nodes."""
        try:
            publishers = dict(self._master.getSystemState()[0])
            self._lookup.is_silent = False
        except (rosgraph.MasterException, OSError) as error:
            self._lookup.is_silent = True
            self._lookups.wait(self._node.monotonic_s())  # the answer took long
            if self._log.is_due(self._node.monotonic_s()):
                self._node.warn(f'scene_watch: the master does not answer: {error}')
            return
        for device in self._devices:
            meanings = self._meanings[device.name]
            for topic in device.topics:
                for node in publishers.get(topic, []):
                    if meanings.setdefault(node, OTHERS_MEANING) == OTHERS_MEANING:
                        self._others.setdefault(node, set()).add(topic)
            self._pulses.watch(meanings)
        self._replace(publishers)

    def _replace(self, publishers: Mapping[str, List[str]]) -> None:
        """Note ended publishers whose topics have new publishers; the master may forget them.

        Nodes that published the same topics before do not count: the markers of the ended one stay.
        """
        nodes = self._pulses.nodes
        present = {topic: {it for it in names if it in nodes and nodes[it].has_answered
                           and not nodes[it].problem} for topic, names in publishers.items()}
        registered = {it for names in publishers.values() for it in names}
        for node, topics in tuple(self._others.items()):
            beside = self._beside.setdefault(node, set())
            if not nodes[node].problem:
                self._replaced.discard(node)
                beside.update(*(present.get(it, ()) for it in topics))
            elif nodes[node].problem == ENDED and all(
                    present.get(it, set()) - beside for it in topics):
                self._replaced.add(node)
            if node in self._replaced - registered:  # anonymous names are never used again
                self._replaced.discard(node)
                del self._others[node], self._beside[node], nodes[node]
                for meanings in self._meanings.values():
                    if meanings.get(node) == OTHERS_MEANING:
                        del meanings[node]

    def _on_age(self, device: str, message: Float32) -> None:
        self._ages[device] = message.data, self._node.monotonic_s()


def main() -> None:
    """Run the node; it ends with status 1 when a parameter is wrong."""
    start_node(SCENE_WATCH)
    try:
        parameters = SceneParameters.read(private_parameters())
    except ParameterError as error:
        rospy.logfatal('%s', error)
        sys.exit(1)
    node = NodeHandle()
    SceneWatch(node, MasterClient(node.name), parameters).run()
