# SPDX-License-Identifier: BSD-3-Clause
"""An operator compares the running cell with a good run, and is notified of deviations."""
from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any, Iterator, List
from xmlrpc.client import ServerProxy

import pytest
import rosgraph
import rospy
from operator_at_work import Operator
from PyQt5.QtWidgets import QTreeWidget
from sewing_bag import write_sewing_bag
from test_operator_session import CONFIG
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.gui.cell.devices_panel import DevicesView
from process_visualizer.nodes.view_picture import save_picture
from process_visualizer.ros_names import GHOST_TOPIC
from sewing_cell.cycle import SewingCycle

CYCLE_S = 20.0


@pytest.fixture
def bag(tmp_path: Path) -> str:
    """Write a good cycle before the window exists, as its thread writes it."""
    return write_sewing_bag(str(tmp_path / 'good.bag'), SewingCycle('good', 3), CYCLE_S)


@pytest.fixture
def operator(bag: str, qtbot: Any) -> Iterator[Operator]:
    person = Operator(qtbot)
    yield person
    person.close()


def test_a_fault_of_the_running_cell_is_told(operator: Operator, bag: str, tmp_path: Path) -> None:
    open_the_faulty_cell(operator)
    choose_reference(operator, bag)
    operator.click('launch')
    operator.wait(lambda: 'Run in range (reference at 0:' in operator.text('status'),
                  'it is followed', instead=operator.messages)
    assert operator.beside(ghost_namespaces) >= {'ur_rt_upper/ghost', 'ur_rt_lower/ghost'}
    operator.wait(lambda: 'tool force +' in operator.text('status'), 'the departure')
    assert ' N above range for ' in operator.text('status')
    assert ' N above range for ' in operator.text('compare_state')
    assert any('above range' in it.condition.text for it in operator.launcher.alarms.alarms)
    assert any(it.band is not None for it in operator.window.live.timeline.stack.lanes)
    operator.beside(lambda: save_picture(str(tmp_path / 'follows.png')))
    end_the_simulator(operator)
    operator.wait(lambda: 'no data since' in operator.text('status'), 'nothing is judged',
                  instead=operator.messages)
    operator.click('launch')  # there is no comparison that would be lost
    operator.wait(lambda: operator.text('status') == 'Idle', 'everything has ended')
    assert operator.messages() == '' and operator.text('compare_state').endswith('they run.')


def open_the_faulty_cell(operator: Operator) -> None:
    operator.launcher.cell.open(CONFIG, {'image_rate': '0', 'fault': 'friction'})
    devices = operator.widget('devices', DevicesView)
    operator.wait(lambda: devices.topLevelItemCount() == 6
                  and operator.widget('launch').isEnabled(), 'it can be launched')
    operator.click_check_box(devices, devices.topLevelItem(2))  # the Kinect


def choose_reference(operator: Operator, bag: str) -> None:
    operator.window.panels.setCurrentIndex(2)
    assert operator.widget('add_recording').isEnabled()
    operator.launcher.compare.add(bag)  # as the dialog for files does
    runs = operator.widget('runs', QTreeWidget)
    operator.wait(lambda: runs.topLevelItemCount() == 1, 'the run is listed',
                  instead=operator.messages)
    operator.click_check_box(runs, runs.topLevelItem(0))
    operator.click('compare_runs')
    operator.wait(lambda: operator.text('compare_state').endswith('they run.'), 'the band')


def ghost_namespaces() -> 'set[str]':
    """Return the namespaces of the ghost's drawn markers."""
    found: List[Marker] = rospy.wait_for_message(GHOST_TOPIC, MarkerArray, 10.0).markers
    return {it.ns for it in found}


def end_the_simulator(operator: Operator) -> None:
    def end() -> None:
        uri = rosgraph.Master('/test').lookupNode('/simulator')
        os.kill(ServerProxy(uri).getPid('/test')[2], signal.SIGKILL)  # type: ignore

    operator.beside(end)
