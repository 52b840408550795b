#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The view of a running RViz is written to a file, and read from one."""
from __future__ import annotations

import copy
import os
import tempfile
import unittest
from typing import Any, Dict

import rospy
import rostest
import yaml
from cloud_testing import Listener, wait_until
from diagnostic_msgs.msg import DiagnosticArray, KeyValue

from process_visualizer.clients.rviz_view import RvizView, RvizViewError

RVIZ_STARTS_WITHIN_S = 90.0


class RvizViewTest(unittest.TestCase):
    """Commands the view of one RViz."""

    @classmethod
    def setUpClass(cls) -> None:
        rospy.wait_for_message('/rviz/display_status', DiagnosticArray, RVIZ_STARTS_WITHIN_S)
        cls.view = RvizView()

    @classmethod
    def tearDownClass(cls) -> None:
        cls.view.close()

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = os.path.join(folder.name, 'a view.rviz')

    def saved(self) -> Dict[str, Any]:
        self.view.save(self.path)
        with open(self.path, encoding='utf-8') as file:
            return dict(yaml.safe_load(file))

    def test_saved_view_has_all_displays(self) -> None:
        displays = self.saved()['Visualization Manager']['Displays']
        names = [display['Name'] for display in displays]
        self.assertEqual(names[:3] + names[4:],
                         ['Status report', 'Floor', 'Bad', 'Calibration', 'Deaf', 'Cloud', 'Lost'])
        self.assertFalse(displays[3]['Enabled'])

    def test_changed_view_comes_back(self) -> None:
        config = self.saved()
        manager = config['Visualization Manager']
        manager['Views']['Current']['Distance'] = 4.25
        manager['Displays'][1]['Displays'][0]['Cell Size'] = 0.125
        manager['Displays'][3]['Name'] = 'Another'
        config['Window Geometry'].update({'Width': 600, 'Height': 440})
        self.shows(config)
        now = self.saved()
        self.assertEqual(now['Visualization Manager']['Views']['Current']['Distance'], 4.25)
        displays = now['Visualization Manager']['Displays']
        self.assertEqual(displays[1]['Displays'][0]['Cell Size'], 0.125)
        self.assertEqual(displays[3]['Name'], 'Another')
        self.assertEqual((now['Window Geometry']['Width'], now['Window Geometry']['Height']),
                         (600, 440))

    def test_status_report_that_is_switched_off_still_says_that_rviz_draws(self) -> None:
        before = self.saved()
        off = copy.deepcopy(before)
        off['Visualization Manager']['Displays'][0]['Enabled'] = False
        try:
            self.shows(off)
            with Listener('/rviz/display_status', DiagnosticArray) as reports:
                wait_until(lambda: len(reports.messages) > 3, 'reports of a display without a tick')
            self.assertIn(KeyValue('enabled', 'false'), reports.messages[-1].status[1].values)
        finally:
            self.shows(before)

    def shows(self, config: Dict[str, Any]) -> None:
        with open(self.path, 'w', encoding='utf-8') as file:
            yaml.safe_dump(config, file)
        self.view.load(self.path)

    def test_file_that_cannot_be_written(self) -> None:
        with self.assertRaisesRegex(RvizViewError, '/rviz cannot write its view to "/no/folder'):
            self.view.save('/no/folder/a.rviz')

    def test_file_that_is_not_there(self) -> None:
        with self.assertRaisesRegex(RvizViewError, '/rviz cannot read a view from "/no/folder'):
            self.view.load('/no/folder/a.rviz')

    def test_no_rviz(self) -> None:
        with self.assertRaisesRegex(RvizViewError, '/nobody/save_config does not answer'):
            RvizView('/nobody').save(self.path)


if __name__ == '__main__':
    rospy.init_node('rviz_view_test')
    rostest.rosrun('process_visualizer', 'rviz_view_test', RvizViewTest)
