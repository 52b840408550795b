#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Requests about loggers do not end our C++ nodes, as they end those with roscpp's own service."""
from __future__ import annotations

import unittest
from typing import Dict

import rospy
import rostest
from roscpp.srv import GetLoggers, SetLoggerLevel

TIMEOUT_S = 60.0
NODES = ('/sensor_fit', '/bag_recorder', '/arm/joint_proc', '/manager')


class LoggerServicesTest(unittest.TestCase):
    """Requests like those of rqt_logger_level, and malicious ones."""

    def levels(self, node: str) -> Dict[str, str]:
        rospy.wait_for_service(f'{node}/get_loggers', TIMEOUT_S)
        answer = rospy.ServiceProxy(f'{node}/get_loggers', GetLoggers)()
        return {it.name: it.level for it in answer.loggers}

    def set_level(self, node: str, logger: str, level: str) -> None:
        rospy.wait_for_service(f'{node}/set_logger_level', TIMEOUT_S)
        rospy.ServiceProxy(f'{node}/set_logger_level', SetLoggerLevel)(logger, level)

    def refusal(self, node: str, logger: str, level: str) -> str:
        with self.assertRaises(rospy.ServiceException) as refused:
            self.set_level(node, logger, level)
        return str(refused.exception)

    def test_they_are_told_again_and_again(self) -> None:
        for node in NODES:
            for _ in range(3):
                self.assertEqual(self.levels(node)['ros'], 'info')

    def test_a_level_is_set(self) -> None:
        for node in NODES:
            for level in ('debug', 'warn', 'info'):
                self.set_level(node, 'ros.process_visualizer', level)
                self.assertEqual(self.levels(node)['ros.process_visualizer'], level)

    def test_what_cannot_be_set_is_refused_in_a_sentence(self) -> None:
        for node in NODES:
            self.assertIn('must be debug, info', self.refusal(node, 'ros', 'all'))
            self.assertIn('1000000 characters', self.refusal(node, 'x' * 1_000_000, 'info'))

    def test_nobody_can_make_loggers_without_end(self) -> None:
        for number in range(200):
            try:
                self.set_level('/sensor_fit', f'ros.invented.n{number}', 'info')
            except rospy.ServiceException as error:
                self.assertIn('no other can be', str(error))
                break
        else:
            self.fail('any number is taken')
        self.set_level('/sensor_fit', 'ros', 'info')


if __name__ == '__main__':
    rospy.init_node('logger_services_test')
    rostest.rosrun('process_visualizer', 'logger_services_test', LoggerServicesTest)
