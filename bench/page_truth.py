# SPDX-License-Identifier: BSD-3-Clause
"""Compares the page of a run with the product: numbers, poses of links, the ghost.

    bench/run page_truth FOLDER [SCENE …] [--positions 200]

FOLDER holds the packages ur_description, franka_description, fanuc_resources,
fanuc_lrmate200id_support and pr2_description, execution_data of
https://github.com/platonics-delft/platonics_dataset, and pr1012_sensors.bag and pr1012_urdf.yaml of
https://github.com/jsk-ros-pkg/jsk_pr2eus (pr2eus/test at 67b1b5a), none of which is part of this
repository.

Each recording is played by bag_player with the cell's nodes and robot_state_publisher, paused at
random positions: some are reached by seeks, the others by steps forwards and backwards. The
page is in a Chromium without a window. The program waits for the output of the nodes; only what
differs after PATIENCE_S counts.
"""
from __future__ import annotations

import argparse
import math
import os
import random
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
import rospy
from makers import TIMEOUT_S, played
from page_scenes import SCENES, Scene
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Cell
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.clients.ghost_client import show_ghost
from process_visualizer.clients.player_client import PlayerClient, PlayerError
from process_visualizer.curves.position_values import PositionValues, key_of
from process_visualizer.film.headless_browser import HeadlessBrowser
from process_visualizer.msg import PlayerState
from process_visualizer.robot.arrows import configured_arrow, format_value, variable_text
from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.visuals import link_visuals
from process_visualizer.runs.comparison.ghost import ghost_arrows, ghost_tracks
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns

PATIENCE_S, SETTLING_S, START_S = 8.0, 1.0, 30.0
POSITION_M, TURN_DEG, GHOST_M = 0.0002, 0.05, 0.001
"""Tolerances of a link's position and orientation, and of a link of the ghost."""
SETTLED_M, SETTLED_DEG = 0.00003, 0.005
"""Tolerances for arrival: a slow robot is near before its last message arrives."""
_MOST_EXAMPLES = 20
SIZE = 480, 320  # the drawn picture does not matter
LABELS = {'speed': 'v', 'force': 'F'}

AT = '''(() => {
  page.transport.pause();
  page.transport.seek(%r);
  const parts = (entries, shown) => entries.filter((it) => it.place !== null).map((it, row) => [
    it.device, it.link, shown[row].mesh.visible, Array.from(shown[row].mesh.matrix.elements)]);
  page.draw(page.transport.time);
  return {
    time: page.transport.time,
    numbers: Array.from(document.querySelectorAll('#numbers td'), (it) => it.textContent),
    links: parts(page.run.parts, page.scene.parts),
    ghost: page.run.ghost ? parts(page.run.ghost.parts, page.scene.ghost.parts) : []};
})()'''
ENTRIES = 'page.run.numbers.map((it) => [it.device, it.quantity, it.label, it.topic])'
BESIDE = 'page.run.ghost ? page.run.ghost.deviations.map((it) => it.device) : []'


class Pose(NamedTuple):
    """Pose of a link."""

    position: np.ndarray
    rotation: np.ndarray


def pose_of(elements: Sequence[float]) -> Pose:
    """Return the pose of a matrix of three.js."""
    matrix = np.array(elements).reshape(4, 4).T
    return Pose(matrix[:3, 3], matrix[:3, :3])


def pose(place: Placement) -> Pose:
    """Return a placement as a pose."""
    x, y, z, w = np.array(place.quaternion) / np.linalg.norm(place.quaternion)
    return Pose(np.array(place.position), np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]))


def apart(first: Pose, second: Pose) -> Tuple[float, float]:
    """Return the distance of two poses [m], and the angle between them [°]."""
    between = first.rotation.T @ second.rotation
    sine = 0.5 * math.hypot(between[2, 1] - between[1, 2], between[0, 2] - between[2, 0],
                            between[1, 0] - between[0, 1])
    return (float(np.linalg.norm(first.position - second.position)),
            math.degrees(math.atan2(sine, 0.5 * (np.trace(between) - 1.0))))


class Shown:
    """The latest output of the nodes: frames, texts beside the robots, the ghost."""

    def __init__(self, cell: Cell) -> None:
        self._changed = threading.Condition()
        self._frames: Dict[str, Tuple[str, Placement]] = {}
        self.texts: Dict[Tuple[str, str], str] = {}
        self.ghost: Dict[Tuple[str, int], Marker] = {}
        self.global_frame = cell.frame
        self._subscribers = [
            rospy.Subscriber('/tf', TFMessage, self._on_tf, queue_size=100),
            rospy.Subscriber('/tf_static', TFMessage, self._on_tf, queue_size=100),
            rospy.Subscriber('/ghost/marker_array', MarkerArray, self._on_ghost),
            *(rospy.Subscriber(f'/{it.name}/marker_array', MarkerArray, self._on_texts, it.name)
              for it in cell.devices)]

    def close(self) -> None:
        for it in self._subscribers:
            it.unregister()

    def _on_tf(self, message: TFMessage) -> None:
        with self._changed:
            for it in message.transforms:
                at, turn = it.transform.translation, it.transform.rotation
                self._frames[it.child_frame_id] = it.header.frame_id, Placement(
                    (at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))
            self._changed.notify_all()

    def _on_texts(self, message: MarkerArray, device: str) -> None:
        with self._changed:
            for it in message.markers:
                if it.type == Marker.TEXT_VIEW_FACING and it.action == Marker.ADD:
                    self.texts[device, it.ns.rpartition('variable/')[2]] = it.text.strip('\n ')
            self._changed.notify_all()

    def _on_ghost(self, message: MarkerArray) -> None:
        with self._changed:
            self.ghost = {(it.ns, it.id if it.type != Marker.TEXT_VIEW_FACING else -1): it
                          for it in message.markers if it.action == Marker.ADD}
            self._changed.notify_all()

    def place(self, frame: str) -> Optional[Placement]:
        """Return the pose of a frame in the cell."""
        found = Placement()
        for _ in range(100):
            if frame == self.global_frame:
                return found
            if frame not in self._frames:
                return None
            frame, outer = self._frames[frame]
            found = outer.then(found)
        return None

    def wait_for(self, condition: Callable[[], bool], patience_s: float = PATIENCE_S) -> bool:
        """Return whether a condition holds, or becomes true in time."""
        with self._changed:
            return bool(self._changed.wait_for(condition, patience_s))


class Figures:
    """Counts and worst cases of the comparisons."""

    def __init__(self) -> None:
        self.positions: Dict[str, int] = {}
        self.numbers = self.wrong_numbers = self.wrong_texts = self.texts = 0
        self.links = self.missing = self.wrong_links = 0
        self.link_m: List[float] = []
        self.link_deg: List[float] = []
        self.ghosts = self.wrong_ghosts = 0
        self.ghost_m: List[float] = []
        self.distances = self.wrong_distances = 0
        self._said = 0

    def say(self, what: str) -> None:
        """Print some examples."""
        self._said += 1
        if self._said <= _MOST_EXAMPLES:
            print(what, file=sys.stderr, flush=True)

    def line(self, name: str) -> str:
        """Return them as a row of a table."""
        def worst(values: Sequence[float], factor: float, form: str) -> str:
            return form.format(factor * max(values)) if values else '–'
        ways = ', '.join(f'{count} {way}' for way, count in self.positions.items())
        return (f'| {name} | {ways} | {self.wrong_numbers} of {self.numbers}; '
                f'{self.wrong_texts} of {self.texts} | {self.wrong_links} of {self.links} '
                f'({self.missing} not sent) | {worst(self.link_m, 1e3, "{:.3f} mm")} | '
                f'{worst(self.link_deg, 1.0, "{:.4f}°")} | {self.wrong_ghosts} of {self.ghosts}, '
                f'{worst(self.ghost_m, 1e3, "{:.3f} mm")} | '
                f'{self.wrong_distances} of {self.distances} |')


class Trial:
    """One recording in the page and in the product."""

    def __init__(self, scene: Scene, count: int, folder: Path) -> None:
        self._scene, self._count, self._folder = scene, count, folder
        self._cell = XmlParser().parse(str(scene.configuration))
        self._figures = Figures()
        self._chance = random.Random(34)

    def run(self) -> Figures:
        scene, page = self._scene, self._folder / 'page.html'
        reference = ['--reference', str(scene.good)] if scene.good else []
        subprocess.run(['rosrun', 'process_visualizer', 'cell', 'share', str(scene.bag), *reference,
                        '--config', str(scene.configuration), '-o', str(page)], check=True)
        self._values = PositionValues([str(scene.bag)], self._cell.devices)
        shown = Shown(self._cell)
        try:
            with HeadlessBrowser(page, SIZE) as browser, \
                    played(scene.configuration, scene.bag, self._folder / 'cell.log') as player:
                links = browser.evaluate('page.run.parts.map((it) => it.link)')
                shown.wait_for(lambda: None not in map(shown.place, links), START_S)
                self._entries = browser.evaluate(ENTRIES)
                self._beside = browser.evaluate(BESIDE)
                self._visuals = {it.name: link_visuals(text) for it in self._cell.devices
                                 for text in [_description(it.name)] if it.model and text}
                if scene.good:
                    self._show_ghost()
                begin_s, end_s = browser.evaluate('[page.run.begin, page.run.end]')
                for way, position_s in self._positions(player, begin_s, end_s):
                    self._figures.positions[way] = self._figures.positions.get(way, 0) + 1
                    self._compare(browser.evaluate(AT % position_s), position_s, shown)
        finally:
            shown.close()
            self._values.close()
        return self._figures

    def _show_ghost(self) -> None:
        """Show the ghost as the launcher does."""
        chosen = ChosenRuns(self._cell)
        good, run = chosen.runs([str(self._scene.good)])[0], chosen.runs([str(self._scene.bag)])[0]
        comparison = GoodRuns(good, []).compare(run)
        show_ghost(ghost_tracks(self._cell, good, [comparison]),
                   ghost_arrows(self._cell, good, [comparison]), start_s=20.0)

    def _positions(self, player: PlayerClient, begin_s: float,
                   end_s: float) -> Iterator[Tuple[str, float]]:
        """Yield the way to reach a position, and the position [s]."""
        with Recording([str(self._scene.bag)]) as recording:
            times_ns = recording.index.time_ns
            begin_ns = recording.begin_ns
        number = found = 0
        while found < self._count:
            number += 1
            wanted_s = round(self._chance.uniform(begin_s + 0.3, end_s - 0.3), 4)
            player.seek(wanted_s)
            position_s = _settled(player, lambda it, at=wanted_s: abs(it.position - at) < 1e-7)
            way = ('sought', 'forwards', 'sought', 'backwards')[number % 4]
            try:
                if way != 'sought':
                    count = self._chance.randint(1, 20) * (1 if way == 'forwards' else -1)
                    if number % 8 < 4:
                        player.step(count=count)
                    else:
                        player.step(duration_s=0.0037 * count)
                    now_s = time.time()
                    position_s = _settled(player, lambda it, at=now_s: it.stamp.to_sec() >= at)
            except PlayerError:
                continue  # at an end
            position_ns = begin_ns + round(position_s * 1e9)
            if way != 'sought' and np.count_nonzero(times_ns == position_ns) > 1:
                continue  # between messages of equal time, which a time cannot distinguish
            found += 1
            yield way, position_s

    def _compare(self, page: Dict[str, Any], position_s: float, shown: Shown) -> None:
        self._compare_numbers(page['numbers'], position_s, shown)
        figures = self._figures
        links = [(link, pose_of(elements)) for _, link, is_visible, elements in page['links']
                 if is_visible]
        if shown.wait_for(lambda: all(_is_link(*it, shown, POSITION_M, TURN_DEG) for it in links)):
            shown.wait_for(lambda: all(_is_link(*it, shown, SETTLED_M, SETTLED_DEG)
                                       for it in links), SETTLING_S)
        for link, drawn in links:
            there = shown.place(link)
            if there is None:
                figures.missing += 1
                continue
            off_m, off_deg = apart(drawn, pose(there))
            figures.links += 1
            figures.link_m.append(off_m)
            figures.link_deg.append(off_deg)
            if off_m > POSITION_M or off_deg > TURN_DEG:
                figures.wrong_links += 1
                figures.say(f'{position_s:.6f} s: {link} {1e3 * off_m:.2f} mm, {off_deg:.3f}°')
        if self._scene.good:
            self._compare_ghost(page, position_s, shown)

    def _compare_numbers(self, texts: Sequence[str], position_s: float, shown: Shown) -> None:
        """Compare numbers with the launcher's values in RViz's format, and the nodes' output."""
        figures, values = self._figures, self._values.at(position_s)
        for (device, quantity, label, topic), text in zip(self._entries, texts):
            value = values[key_of(device, LABELS.get(quantity, label), topic)]
            expected = self._words(device, quantity, label, topic, value)
            figures.numbers += 1
            if text != expected and 'no data' not in text:
                figures.wrong_numbers += 1
                figures.say(f'{position_s:.6f} s: {device} {text!r}, launcher {expected!r}')
            name = {'speed': 'velocity'}.get(quantity, quantity if quantity == 'force' else label)
            if (device, name) not in shown.texts:
                continue  # RViz does not show it
            figures.texts += 1
            in_rviz = text.replace('–', 'no data')
            if not shown.wait_for(lambda: shown.texts[device, name] == in_rviz):  # noqa: B023
                figures.wrong_texts += 1
                figures.say(f'{position_s:.6f} s: {device} {text!r}, RViz '
                            f'{shown.texts[device, name]!r}')

    def _words(self, device_name: str, quantity: str, label: str, topic: str,
               value: Optional[float]) -> str:
        device = self._cell.device(device_name)
        style = configured_arrow(device, 'velocity' if quantity == 'speed' else 'force')
        if value is None:
            return f'{style.label if quantity == "speed" else label} –'
        if quantity in LABELS:
            return format_value(style.label, value, style.unit, style.decimals)
        variable = next((it for it in device.variables if it.topic == topic
                         and (it.label or it.topic.strip('/')) == label), None)
        number = int(value) if topic in self._scene.whole else value
        if variable is None:
            return variable_text(label, number, '', 0.0, 0.0)
        text = variable_text(label, number, variable.unit, variable.offset, variable.scale)
        names = dict(variable.value_names)
        return f'{text} ({names[value]})' if value in names else text

    def _compare_ghost(self, page: Dict[str, Any], position_s: float, shown: Shown) -> None:
        figures = self._figures
        visible = {(device, link): pose_of(elements)
                   for device, link, is_visible, elements in page['ghost'] if is_visible}
        wanted = [(device, number, visual) for device, visuals in self._visuals.items()
                  for number, visual in enumerate(visuals) if (device, visual.link) in visible]

        def off_m(device: str, number: int, visual: Any) -> float:
            marker = shown.ghost.get((f'{device}/ghost', number))
            root = None if marker is None else shown.place(marker.header.frame_id)
            if marker is None or root is None:
                return math.inf
            at, turn = marker.pose.position, marker.pose.orientation
            drawn = visible[device, visual.link]
            there = pose(root.then(Placement((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))))
            inner = pose(visual.place)
            return apart(Pose(drawn.position + drawn.rotation @ inner.position,
                              drawn.rotation @ inner.rotation), there)[0]

        if shown.wait_for(lambda: all(off_m(*it) <= GHOST_M for it in wanted)):
            shown.wait_for(lambda: all(off_m(*it) <= SETTLED_M for it in wanted), SETTLING_S)
        for it in wanted:
            figures.ghosts += 1
            off = off_m(*it)
            if math.isfinite(off):
                figures.ghost_m.append(off)
            if not off <= GHOST_M:
                figures.wrong_ghosts += 1
                figures.say(f'{position_s:.6f} s: ghost {it[0]} {it[2].link} {1e3 * off:.2f} mm')
        for device, text in zip(self._beside, page['numbers'][len(self._entries):]):
            marker = shown.ghost.get((f'{device}/deviation', -1))
            if marker is None:
                continue
            figures.distances += 1
            words = marker.text.strip()
            if not text.startswith(words):
                figures.wrong_distances += 1
                figures.say(f'{position_s:.6f} s: {device} {text!r}, RViz {words!r}')


def _is_link(link: str, drawn: Pose, shown: Shown, within_m: float, within_deg: float) -> bool:
    there = shown.place(link)
    if there is None:
        return True  # no node sends it
    off_m, off_deg = apart(drawn, pose(there))
    return off_m <= within_m and off_deg <= within_deg


def _settled(player: PlayerClient, is_there: Callable[[PlayerState], bool]) -> float:
    """Return the position once the player has reported it."""
    state = player.wait_for(lambda it: it.paused and is_there(it), TIMEOUT_S)
    assert state is not None
    return float(state.position)


def _description(device: str) -> str:
    return str(rospy.get_param(f'/{device}/robot_description', ''))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('folder', type=Path)
    parser.add_argument('scenes', nargs='*', metavar='SCENE', help=', '.join(SCENES))
    parser.add_argument('--positions', type=int, default=200)
    parser.add_argument('--work', type=Path, default=Path(tempfile.gettempdir(), 'page_truth'))
    arguments = parser.parse_args()
    os.environ['ROS_PACKAGE_PATH'] += f':{arguments.folder.resolve()}'
    port = os.environ['ROS_MASTER_URI'].rpartition(':')[2]
    core = subprocess.Popen(['roscore', '-p', port], stdout=subprocess.DEVNULL,
                            stderr=subprocess.DEVNULL)
    try:
        rospy.init_node('page_truth', disable_signals=True)
        print('| recording | positions | numbers: launcher; RViz | links | furthest | turned '
              '| ghost | its distances |\n|---|---|---|---|---|---|---|---|')
        for name in arguments.scenes or SCENES:
            folder = arguments.work.resolve() / name
            folder.mkdir(parents=True, exist_ok=True)
            figures = Trial(SCENES[name](folder, arguments.folder), arguments.positions,
                            folder).run()
            print(figures.line(name), flush=True)
    finally:
        core.terminate()
        core.wait()


if __name__ == '__main__':
    main()
