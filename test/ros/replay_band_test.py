#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The RViz display ReplayBand: its window appears when commanded, with band and live camera."""
from __future__ import annotations

import contextlib
import os
import subprocess
import tempfile
import unittest
from typing import Any, Callable, Dict, Iterator, Sequence

import numpy as np
import rospy
import rostest
import yaml
from cloud_testing import Listener, wait_until
from diagnostic_msgs.msg import DiagnosticArray
from display_places import picture_pixels
from rviz_displays_test import Reports, rviz, values
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.clients.rviz_view import RvizView
from process_visualizer.msg import PlayerState
from process_visualizer.nodes.view_picture import save_picture
from process_visualizer.ros_names import DISPLAY_STATUS_TOPIC, PLAYER_STATE_TOPIC, RVIZ_KEY_TOPIC
from process_visualizer.srv import ShowReplay

RVIZ_STARTS_WITHIN_S = 90.0
AMBER = (0xf5, 0xa6, 0x23)
MIN_AMBER_PIXELS = 10000
"""The band alone has 30000 pixels."""
CURTAIN = (0x20, 0x23, 0x2b)
MIN_CURTAIN_PIXELS = 100000
"""It covers the scene, which has four times as many pixels."""
MIN_WORDS_PIXELS = 200
"""Amber pixels of the text on the curtain, which has several times as many."""
KEYS = 'Esc\nSpace'
SERVICE = '/rviz/show_replay'
VIEW: Dict[str, Any] = {'Panels': [], 'Visualization Manager': {
    'Displays': [
        {'Class': 'rviz/Grid', 'Name': 'Grid', 'Enabled': True},
        {'Class': 'rviz/Image', 'Name': 'Image', 'Enabled': True, 'Image Topic': '/image'},
        {'Class': 'rviz/MarkerArray', 'Name': 'Model', 'Enabled': True, 'Marker Topic': '/model'},
        {'Class': 'process_visualizer/ReplayBand', 'Name': 'Replay', 'Enabled': True,
         'Shown At Start': False},
        {'Class': 'process_visualizer/DisplayStatus', 'Name': 'Report', 'Enabled': True}],
    'Global Options': {'Fixed Frame': 'world', 'Frame Rate': 30},
    'Views': {'Current': {'Class': 'rviz/Orbit', 'Distance': 3}}},
    'Window Geometry': {'Width': 1000, 'Height': 700}}


def is_on_screen() -> bool:
    """Return whether RViz's main window is mapped."""
    return subprocess.run(['xdotool', 'search', '--onlyvisible', '--name', 'RViz$'], check=False,
                          stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0


def window_width() -> int:
    """Return the width of RViz's main window, px."""
    text = subprocess.run(
        ['xdotool', 'search', '--onlyvisible', '--name', 'RViz$', 'getwindowgeometry', '--shell'],
        check=True, stdout=subprocess.PIPE, universal_newlines=True).stdout
    return int(dict(line.split('=') for line in text.split())['WIDTH'])


@contextlib.contextmanager
def held_model(folder: str) -> Iterator[str]:
    """Yield the path of a model; its readers wait until the end of the block."""
    path = f'{folder}/held.stl'
    os.mkfifo(path)
    try:
        yield path
    finally:
        writer = os.open(path, os.O_RDWR)
        os.unlink(path)
        os.close(writer)


def playing(ago_s: float) -> PlayerState:
    """Return the state of a player that plays a moment some seconds ago."""
    now = rospy.Time.now()
    return PlayerState(stamp=now, since=now - rospy.Duration(5), begin=now - rospy.Duration(60),
                       duration=60.0, position=60.0 - ago_s, rate=1.0)


class ReplayBandTest(unittest.TestCase):
    """One RViz that begins hidden."""

    def setUp(self) -> None:
        stack = contextlib.ExitStack()
        self.addCleanup(stack.close)
        self.folder = stack.enter_context(tempfile.TemporaryDirectory())
        self.show_replay = rospy.ServiceProxy(SERVICE, ShowReplay)
        self.player = rospy.Publisher(PLAYER_STATE_TOPIC, PlayerState, queue_size=1)
        self.reports = Reports(
            stack.enter_context(Listener(DISPLAY_STATUS_TOPIC, DiagnosticArray)))
        self.cameras = stack.enter_context(Listener('/rviz/camera', String))
        self.model = rospy.Publisher('/model', MarkerArray, queue_size=1, latch=True)
        self.start(stack)

    def start(self, stack: contextlib.ExitStack) -> None:
        """Start RViz, and wait until it accepts commands."""
        with open(f'{self.folder}/replay.rviz', 'w', encoding='utf-8') as file:
            yaml.safe_dump(VIEW, file)
        stack.enter_context(rviz(f'{self.folder}/replay.rviz'))
        rospy.wait_for_service('/rviz/save_config', RVIZ_STARTS_WITHIN_S)
        rospy.wait_for_service(SERVICE, RVIZ_STARTS_WITHIN_S)

    @staticmethod
    def wait(condition: Callable[[], bool], what: str) -> None:
        wait_until(condition, what)

    def show(self, is_shown: bool, place: Sequence[int] = (0, 0, 0, 0), **camera: Any) -> None:
        """Let the window appear or disappear, and wait until it has."""
        text = yaml.safe_dump({'Class': 'rviz/Orbit', 'Target Frame': 'base', **camera})
        answer = self.show_replay(is_shown, text if camera else '', *place, KEYS)
        self.assertTrue(answer.success, answer.message)
        self.wait(lambda: is_on_screen() == is_shown, f'on the screen: {is_shown}')

    def wait_until_still(self) -> None:
        """Wait until nothing is drawn any more."""
        self.wait(self.reports.stand_still, 'it draws, though hidden')

    def frames(self) -> int:
        return int(values(self.reports.newest()['rviz'])['frames'])

    def camera(self) -> Dict[str, Any]:
        """Return RViz's camera, as it reports it."""
        return dict(yaml.safe_load(self.cameras.messages[-1].data))

    def wait_for_camera(self, **properties: Any) -> None:
        self.wait(lambda: properties.items() <= self.camera().items(), f'camera {properties}')

    def saved(self) -> Dict[str, Any]:
        """Return the content of a view file that RViz saves."""
        path = f'{self.folder}/saved.rviz'
        view = RvizView()
        self.addCleanup(view.close)
        view.save(path)
        with open(path, encoding='utf-8') as file:
            return dict(yaml.safe_load(file))

    def test_replay(self) -> None:
        with held_model(self.folder) as path:
            model = Marker(type=Marker.MESH_RESOURCE, mesh_resource=f'file://{path}')
            model.header.frame_id, model.color.a = 'world', 1.0
            model.pose.orientation.w = model.scale.x = model.scale.y = model.scale.z = 1.0
            self.model.publish(MarkerArray([model]))
            self.wait(lambda: self.model.get_num_connections() > 0, 'it listens, though hidden')
            self.wait_until_still()
            self.assertFalse(is_on_screen(), 'it begins hidden')
            self.show(True, (40, 60, 1100, 640), Distance=7.25, Yaw=1.5)
            self.check_curtain()
        self.wait(lambda: self.pixels(CURTAIN) == 0, 'the first picture')
        self.check_drawing()
        self.check_place()
        self.check_camera()
        self.check_mark()
        self.check_keys()
        self.check_hiding()
        self.check_saved()

    def check_curtain(self) -> None:
        """While a model is loaded for the first picture, a text replaces it."""
        self.wait(lambda: self.pixels(CURTAIN) > MIN_CURTAIN_PIXELS, 'a curtain')
        seen = self.screen()
        rows, columns = np.nonzero((seen == CURTAIN).all(axis=2))
        curtain = seen[rows.min():rows.max(), columns.min():columns.max()]
        self.assertGreater((curtain == AMBER).all(axis=2).sum(), MIN_WORDS_PIXELS)

    def screen(self) -> np.ndarray:
        """Return the colors (height, width, 3) of the screen."""
        picture = f'{self.folder}/view.png'
        save_picture(picture)
        return picture_pixels(picture)

    def pixels(self, color: Sequence[int]) -> int:
        """Return the number of pixels of the screen that have a color."""
        return int((self.screen() == color).all(axis=2).sum())

    def check_drawing(self) -> None:
        self.reports.wait(lambda report: 'rviz' in report)
        self.reports.wait_for_frames()
        self.assertEqual(self.reports.newest()['Replay'].level, 0, self.reports.newest()['Replay'])

    def check_camera(self) -> None:
        self.wait_for_camera(Distance=7.25, Yaw=1.5, **{'Target Frame': 'base'})

    def check_place(self) -> None:
        self.wait(lambda: window_width() == 1100, 'it is where it was told to be')

    def check_mark(self) -> None:
        """The band shows that the player is missing, its position, and that it was lost."""
        self.wait(lambda: self.pixels(AMBER) > MIN_AMBER_PIXELS, 'band and frame')
        for _ in range(5):
            self.player.publish(playing(12.3))
            self.reports.wait_for_frames()
        self.assertGreater(self.pixels(AMBER), MIN_AMBER_PIXELS)

    def check_keys(self) -> None:
        """Keys are forwarded as in the live RViz."""
        with Listener(RVIZ_KEY_TOPIC, String) as presses:
            subprocess.run(['xdotool', 'search', '--onlyvisible', '--name', 'RViz$',
                            'windowfocus', '--sync', 'key', 'space'], check=True)
            self.wait(lambda: [it.data.split('\n')[0] for it in presses.messages] == ['Space'],
                      'the key')

    def check_hiding(self) -> None:
        self.show(False)
        self.wait_until_still()
        frames = self.frames()
        self.show(True, Class='rviz/TopDownOrtho', Scale=64.5)
        self.wait(lambda: self.frames() > frames + 5, 'drawing goes on')
        self.wait_for_camera(Class='rviz/TopDownOrtho', Scale=64.5)

    def check_saved(self) -> None:
        """A view is saved as usual; hiding the window does not switch off displays with a panel."""
        manager = self.saved()['Visualization Manager']
        self.assertEqual([it['Class'] for it in manager['Displays'] if it['Enabled']],
                         [it['Class'] for it in VIEW['Visualization Manager']['Displays']])
        self.assertEqual(manager['Global Options']['Fixed Frame'], 'world')


if __name__ == '__main__':
    rospy.init_node('replay_band_test')
    rostest.rosrun('process_visualizer', 'replay_band_test', ReplayBandTest)
