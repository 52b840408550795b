#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Texts on plates in RViz: drawn, switched off, expired; RViz survives any input."""
from __future__ import annotations

import contextlib
import math
import subprocess
import tempfile
import time
import unittest
from typing import Callable, List

import rospy
import rostest
import yaml
from cloud_testing import Listener
from diagnostic_msgs.msg import DiagnosticArray
from rviz_displays_test import MIN_PIXELS, WITHIN_S, Reports, rviz
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.nodes.common.markers import text_marker
from process_visualizer.nodes.view_picture import save_picture
from process_visualizer.ros_names import DISPLAY_STATUS_TOPIC

COLOR = (0.0, 1.0, 0.0, 1.0)
VIEW = {'Panels': [], 'Visualization Manager': {
    'Displays': [
        {'Class': 'process_visualizer/MarkerArray', 'Name': 'Labels', 'Enabled': True,
         'Marker Topic': '/labels'},
        {'Class': 'process_visualizer/DisplayStatus', 'Name': 'Report', 'Enabled': True}],
    'Global Options': {'Fixed Frame': 'world', 'Frame Rate': 30},
    'Views': {'Current': {'Class': 'rviz/Orbit', 'Distance': 3}}}}


def label(name: str, text: str, **changes: float) -> Marker:
    """Return a text at the origin; its position [m] and height [m] can be changed."""
    marker = text_marker(name, 'base', (0.0, 0.0, 0.0), text, changes.pop('height', 0.05), COLOR)
    for axis, value in changes.items():
        setattr(marker.pose.position, axis, value)
    return marker


def odd_labels() -> List[Marker]:
    """Return texts that are invalid, at no valid position, too large, too far away, or too many."""
    lost = label('lost', 'a')
    lost.header.frame_id = 'nowhere'
    return [label('nan', 'a', x=math.nan), label('far', 'a', x=1e30), label('empty', ''),
            label('infinite', 'a', height=math.inf), label('none', 'a', height=0.0), lost,
            label('long', 'x' * 100000), label('lines', '\n' * 5000 + 'a\n' * 5000),
            *(label(f'many {i}', f'{i}', x=0.001 * i) for i in range(1000)),
            Marker(ns='many 1', id=1, action=Marker.DELETE), Marker(action=Marker.DELETEALL),
            label('last', 'after all')]


def green_pixels(picture: str) -> int:
    """Return the number of pixels of the text's color."""
    text = subprocess.run(
        ['convert', picture, '-fill', 'black', '+opaque', '#00ff00', '-fill', 'white',
         '-opaque', '#00ff00', '-format', '%[fx:mean*w*h]', 'info:'],
        check=True, stdout=subprocess.PIPE, universal_newlines=True).stdout
    return round(float(text))


class LabelsTest(unittest.TestCase):
    """One RViz with a display of labels."""

    def setUp(self) -> None:
        stack = contextlib.ExitStack()
        self.addCleanup(stack.close)
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        self.picture = f'{folder}/view.png'
        with open(f'{folder}/labels.rviz', 'w', encoding='utf-8') as file:
            yaml.safe_dump(VIEW, file)
        stack.enter_context(rviz(f'{folder}/labels.rviz'))
        self.reports = Reports(
            stack.enter_context(Listener(DISPLAY_STATUS_TOPIC, DiagnosticArray)))
        self.reports.wait(lambda report: 'Labels' in report)
        self.publisher = rospy.Publisher('/labels', MarkerArray, queue_size=1)

    def wait(self, markers: Callable[[], List[Marker]], condition: Callable[[int], bool]) -> bool:
        """Publish markers until the picture shows them, or time is up."""
        end = time.monotonic() + WITHIN_S
        while time.monotonic() < end:
            self.publisher.publish(MarkerArray(markers()))
            self.reports.wait_for_frames()
            save_picture(self.picture)
            if condition(green_pixels(self.picture)):
                return True
        return False

    def test_labels(self) -> None:
        shown = self.wait(lambda: [label('a', 'value 888 m/s')], lambda count: count > MIN_PIXELS)
        self.assertTrue(shown, 'a text is drawn')
        self.assertTrue(self.wait(lambda: [], lambda count: count == 0), 'it expires')
        for _ in range(5):
            self.publisher.publish(MarkerArray(odd_labels()))
            self.reports.wait_for_frames()
        shown = self.wait(lambda: [label('a', 'value 888 m/s')], lambda count: count > MIN_PIXELS)
        self.assertTrue(shown, 'RViz goes on')


if __name__ == '__main__':
    rospy.init_node('labels_test')
    rostest.rosrun('process_visualizer', 'labels_test', LabelsTest)
