# SPDX-License-Identifier: BSD-3-Clause
"""Accuracy and cost of the ghost on a recording of the simulated cell's cycles.

usage: bench/run ghost CONFIG BAG

The first run is the reference. At 100 positions of the others, the ghost's tool is compared with
its pose from the joints in the bag at the reference's own time: read by rosbag, and interpolated
between the two samples around that time.
"""
from __future__ import annotations

import math
import random
import sys
import time
from typing import Dict, List, Tuple

import numpy as np
import rosbag

from process_visualizer.cell.model import TopicFunction
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.clients.ghost_client import ghost_request
from process_visualizer.curves.source_locators import joint_matching
from process_visualizer.nodes.ghost.ghost_display import RATE_HZ, ghost_arrow
from process_visualizer.nodes.ghost.ghost_robot import GhostRobot
from process_visualizer.robot.description import describe_device
from process_visualizer.robot.kinematics import Kinematics, Placement
from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.comparison.ghost import ghost_arrows, ghost_tracks
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns

POSITIONS = 100
_MAX_TRIES = 100 * POSITIONS  # positions outside of the reference do not count


def recorded(bag: str, topic: str) -> Tuple[np.ndarray, np.ndarray]:
    """Return times [s] from the bag's first message, and joints, of a topic of plain numbers."""
    with rosbag.Bag(bag) as file:
        begin_s = file.get_start_time()
        rows = [(stamp.to_sec() - begin_s, message.data)
                for _, message, stamp in file.read_messages([topic])]
    return np.array([it[0] for it in rows]), np.array([it[1] for it in rows])


def angle_deg(one: Placement, other: Placement) -> float:
    cosine = abs(sum(a * b for a, b in zip(one.quaternion, other.quaternion)))
    return math.degrees(2.0 * math.acos(min(cosine, 1.0)))


def errors(robot: GhostRobot, urdf: str, tool: str, joints: Tuple[str, ...],
           series: Tuple[np.ndarray, np.ndarray], reference_begin_s: float,
           found: List[Comparison]) -> Tuple[List[float], List[float]]:
    """Return the difference in mm and degrees."""
    chance, arm = random.Random(16), Kinematics(urdf)
    far, turned = [], []
    for _ in range(_MAX_TRIES):
        if len(far) == POSITIONS:
            break
        it = chance.choice(found)
        at_s = chance.uniform(0.1, it.run.duration_s - 0.1)
        then_s = float(it.alignment.time_map.to_reference(np.array([at_s]))[0])
        place = robot.tool(it.run.begin_s + at_s)
        if place is None:  # the reference had not begun, or had ended
            continue
        values: Dict[str, float] = {
            joint: float(np.interp(then_s + reference_begin_s, series[0], series[1][:, column]))
            for column, joint in enumerate(joints)}
        wanted = arm.placement(tool, robot.root, values)
        assert wanted is not None
        far.append(1000.0 * math.dist(place.position, wanted.position))
        turned.append(angle_deg(place, wanted))
    return far, turned


def main() -> None:
    """Print the results."""
    config, bag = sys.argv[1:]
    cell = XmlParser().parse(config)
    runs = ChosenRuns(cell).runs([bag])
    good = GoodRuns(runs[0])
    found = [good.compare(run) for run in runs[1:]]
    begin_s = time.perf_counter()
    tracks = ghost_tracks(cell, good.reference, found)
    print(f'{len(runs)} runs, {len(tracks)} robots; the tracks take '
          f'{time.perf_counter() - begin_s:.2f} s\n')
    print('| robot | positions | off, p95 | at most | turned, at most |\n|---|---|---|---|---|')
    robots = []
    for track in tracks:
        device = cell.device(track.device)
        description = describe_device(device)
        robot = GhostRobot(track.device, description.text, track.tool, track.there,
                           track.there._replace(positions=track.here))
        robots.append(robot)
        topic = device.topic_for(TopicFunction.JOINT_STATES)
        assert topic is not None
        far, turned = errors(robot, description.text, track.tool,
                             joint_matching(device, description).joints,
                             recorded(bag, topic.name), good.reference.begin_s, found)
        print(f'| {track.device} | {len(far)} | {np.quantile(far, 0.95):.3f} mm '
              f'| {max(far):.3f} mm | {max(turned):.4f}° |')
    arrows = [ghost_arrow(it) for it in ghost_request(
        (), ghost_arrows(cell, good.reference, found)).arrows]
    begin_s = time.process_time()
    for number in range(600):
        time_s = found[0].run.begin_s + number / RATE_HZ % found[0].run.duration_s
        for robot in robots:
            robot.markers(time_s)
        for arrow in arrows:
            arrow.marker(robots, time_s)
    per_second = (time.process_time() - begin_s) / 600 * RATE_HZ
    print(f'\nmarkers of {len(robots)} robots and {len(arrows)} arrows, {RATE_HZ:.0f} times a '
          f'second: {per_second:.1%} of a core')


if __name__ == '__main__':
    main()
