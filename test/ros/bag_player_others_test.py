#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The player beside real nodes that publish the same topics: their names, and their types."""
from __future__ import annotations

import subprocess
import sys
import unittest
from pathlib import Path
from typing import Any

import rospy
import rostest
from player_testing import Listener, Player, cell_rows, temporary_folder, write_bag
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String

from process_visualizer.player.player_program import NOT_ALL

DRIVER = """
import sys, rospy
from std_msgs.msg import Float32MultiArray
rospy.init_node('driver')
publishers = [rospy.Publisher(topic, Float32MultiArray, queue_size=1) for topic in sys.argv[1:]]
print('publishes', flush=True)
rospy.spin()
"""


class Driver:
    """A node that publishes topics, in a ``with``."""

    def __init__(self, *topics: str) -> None:
        self.process = subprocess.Popen([sys.executable, '-c', DRIVER, *topics],
                                        stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        self.process.stdout.readline()

    def __enter__(self) -> Driver:
        return self

    def __exit__(self, *_error: Any) -> None:
        if self.process.poll() is None:
            self.process.terminate()
        self.process.communicate(timeout=60)

    def kill(self) -> None:
        """End it without unregistering: the master still knows it."""
        self.process.kill()
        self.process.wait()


class BagPlayerOthersTest(unittest.TestCase):
    """The topics /tcf (an array), /image, /info and others are played."""

    def setUp(self) -> None:
        folder = temporary_folder()
        self.addCleanup(folder.cleanup)
        self.bag = write_bag(Path(folder.name) / 'cell.bag', cell_rows())

    def test_a_driver_that_starts_is_told_and_is_nobody_once_it_was_killed(self) -> None:
        with Player(self.bag, '--keep-alive', '--loop', '--others', 'pause') as player:
            player.wait_for_state(lambda it: not it.paused and it.position > 0.1, 'plays')
            with Driver('/tcf') as driver:
                state = player.wait_for_state(lambda it: bool(it.others) and it.paused, 'paused')
                self.assertEqual(state.others, ['/tcf is published by /driver'])
                driver.kill()
                player.wait_for_state(lambda it: not it.others, 'nobody else')
            player.process.terminate()
            self.assertIn('/tcf is published by /driver, in addition to the recording: stop it',
                          player.wait()[1])

    def test_types_and_definitions_that_are_in_use_are_left_out(self) -> None:
        class OldInfo(CameraInfo):
            """The type as another version of its package defines it."""

            _md5sum = '0' * 32

        publishers = [rospy.Publisher(topic, kind, queue_size=1) for topic, kind in (
            ('/tcf', String), ('/info', OldInfo), ('/image', Image))]
        try:
            with Player(self.bag, '-r', '4') as player:
                code, output = player.wait()
        finally:
            for publisher in publishers:
                publisher.unregister()
        self.assertEqual(code, NOT_ALL)
        self.assertIn('/tcf: left out, as it is std_msgs/Float32MultiArray in the recording, but '
                      'std_msgs/String where /', output)
        self.assertIn('/info: left out, as the definition of sensor_msgs/CameraInfo', output)
        self.assertNotIn('/image: left out', output)
        with Listener('/tcf') as listener, Player(self.bag, '--pause'):
            listener.wait_for(lambda: bool(listener.of('/tcf')),
                              'the topic once nobody else has it')


if __name__ == '__main__':
    rospy.init_node('bag_player_others_test')
    rostest.rosrun('process_visualizer', 'bag_player_others_test', BagPlayerOthersTest)
