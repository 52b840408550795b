# SPDX-License-Identifier: BSD-3-Clause
"""What an operator sees when files, nodes, folders and the master are not as they should be."""
from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any, Iterator, List, Set

import pytest
import rosbag
import rospy
from genpy import Time
from operator_at_work import Operator, nodes, processes
from PyQt5.QtCore import QPoint
from PyQt5.QtWidgets import QMessageBox
from running_program import SMALL_CELL
from small_disk import SmallDisk
from std_msgs.msg import Float64, String

from process_visualizer.bags.catalogue import read_catalogue
from process_visualizer.gui.models.recording.recording_types import Phase
from process_visualizer.gui.views.cell.devices_view import DevicesView

LAUNCH_S = 60.0
BROKEN_CELL = SMALL_CELL.replace('type="other" name="table"', 'type="othr" name="table"')
MOVED_CELL = SMALL_CELL.replace('0 0 0.7 0 0 0', '0 0 0.9 0 0 0')
REALTIME = 'In real-time mode.'
IDLE = 'Idle'


@pytest.fixture
def operator(qtbot: Any) -> Iterator[Operator]:
    person = Operator(qtbot)
    yield person
    person.close()


def test_troubles(operator: Operator, tmp_path: Path) -> None:
    config = tmp_path / 'cell.xml'
    open_a_broken_file_and_mend_it(operator, config)
    launch(operator)
    break_the_file_while_nodes_run(operator, config)
    change_a_device(operator, config)
    restart_a_device(operator)
    a_node_is_killed(operator)
    folder_without_permission(operator)
    the_disk_becomes_full(operator, tmp_path / 'disk')
    bag = close_while_recording(operator, tmp_path / 'bags')
    quit_all(operator)
    bag_of_other_devices(operator, tmp_path / 'foreign.bag')
    bag_in_two_files(operator, tmp_path)
    bag_is_deleted(operator, bag)
    the_master_hangs(operator)
    the_master_is_killed(operator)
    assert {it for it in processes('GUI_TEST_MARK') if 'Xvfb' not in it} == set()


def devices(operator: Operator) -> DevicesView:
    return operator.widget('devices', DevicesView)


def pid(node: str) -> int:
    """The process of a node, by its name without namespace."""
    [line] = [it for it in processes('GUI_TEST_MARK') if f'__name:={node} ' in it]
    return int(line.split()[0])


def pids(*node_names: str) -> Set[int]:
    return {pid(node) for node in node_names}


def close_message(operator: Operator) -> None:
    operator.widget('message', QMessageBox).accept()
    operator.wait(lambda: operator.messages() == '', 'the message has gone')


def open_a_broken_file_and_mend_it(operator: Operator, config: Path) -> None:
    config.write_text(BROKEN_CELL)
    operator.launcher.cell.open(str(config))
    operator.wait(lambda: operator.widget('problems').isVisible(), 'the problems')
    assert 'in the configuration' in operator.text('problems_title')
    assert not devices(operator).isVisible()
    assert not operator.widget('launch').isEnabled()
    config.write_text(SMALL_CELL)
    operator.click('reload_configuration')
    operator.wait(lambda: devices(operator).topLevelItemCount() == 2, 'two devices')
    assert devices(operator).isVisible()
    assert not operator.widget('problems').isVisible()


def launch(operator: Operator) -> None:
    operator.wait(lambda: operator.widget('launch').isEnabled(), 'it can be launched')
    operator.click('launch')
    operator.wait(lambda: operator.text('status').startswith(REALTIME), 'all is up', LAUNCH_S)
    operator.wait(lambda: operator.widget('record').isEnabled(), 'it can record')
    operator.wait(lambda: '/rviz' in nodes(), 'RViz', LAUNCH_S)


def break_the_file_while_nodes_run(operator: Operator, config: Path) -> None:
    before = nodes(), pids('simulator', 'plate', 'bag_recorder')
    config.write_text(BROKEN_CELL)
    operator.click('reload_configuration')
    operator.wait(lambda: operator.widget('problems').isVisible(), 'the problems')
    assert 'Keeping the last valid configuration' in operator.text('problems_note')
    rows = [devices(operator).topLevelItem(row) for row in range(2)]
    assert devices(operator).isVisible()
    assert [row.text(0) for row in rows] == ['sensors (other)', 'table (other)']
    assert devices(operator).state_text('table') == 'running'
    assert [device.name for device in operator.launcher.cell.devices] == ['sensors', 'table']
    assert operator.text('status').startswith(REALTIME)
    assert not operator.widget('apply').isVisible()
    assert (nodes(), pids('simulator', 'plate', 'bag_recorder')) == before


def change_a_device(operator: Operator, config: Path) -> None:
    others, plate = pids('simulator', 'bag_recorder', 'rviz'), pid('plate')
    config.write_text(MOVED_CELL)
    operator.click('reload_configuration')
    operator.wait(lambda: operator.widget('apply').isVisible(), 'the change is offered')
    assert operator.text('apply') == 'Apply: restart table'
    assert not operator.widget('problems').isVisible()
    assert not operator.widget('problems_note').isVisible()
    assert pid('plate') == plate
    operator.click('apply')
    operator.wait(lambda: operator.text('status').startswith(REALTIME)
                  and not operator.widget('apply').isVisible(), 'it is applied', LAUNCH_S)
    assert pid('plate') != plate
    assert pids('simulator', 'bag_recorder', 'rviz') == others


def restart_a_device(operator: Operator) -> None:
    others, plate = pids('simulator', 'bag_recorder'), pid('plate')
    operator.click_row(devices(operator), devices(operator).topLevelItem(1))
    operator.click('restart_device')
    operator.wait(lambda: '/table/plate' in nodes() and _is_other(plate), 'another plate')
    operator.wait(lambda: devices(operator).state_text('table') == 'running', 'it runs')
    assert pids('simulator', 'bag_recorder') == others


def _is_other(plate: int) -> bool:
    found = {it.split()[0] for it in processes('GUI_TEST_MARK') if '__name:=plate ' in it}
    return len(found) == 1 and found != {str(plate)}


def a_node_is_killed(operator: Operator) -> None:
    os.kill(pid('plate'), signal.SIGKILL)
    operator.wait(lambda: 'SIGKILL' in devices(operator).state_text('table'),
                  'how it ended', instead=lambda: devices(operator).state_text('table'))
    assert 'table' in operator.text('status')
    row = devices(operator).topLevelItem(1)
    row.setExpanded(True)
    operator.click_row(devices(operator), row.child(0), twice=True)
    operator.wait(lambda: 'killed by SIGKILL' in operator.text('log_message'), 'its log')
    operator.widget('log').close()
    operator.click_row(devices(operator), row)
    operator.click('restart_device')
    operator.wait(lambda: devices(operator).state_text('table') == 'running', 'it runs again')


def folder_without_permission(operator: Operator) -> None:
    choices = operator.launcher.recording.choices
    choices.set_folder('/proc/recordings')
    operator.wait(lambda: '/proc' in choices.problem, 'the folder cannot be used',
                  instead=lambda: choices.problem)
    operator.launcher.recording.start()
    operator.wait(lambda: '/proc' in operator.messages(), 'a message', instead=operator.messages)
    close_message(operator)
    assert operator.launcher.recording.phase is Phase.IDLE


def the_disk_becomes_full(operator: Operator, folder: Path) -> None:
    recording = operator.launcher.recording
    with SmallDisk(folder) as disk:
        recording.choices.set_folder(str(folder))
        operator.wait(lambda: operator.widget('record').isEnabled(), 'it can record')
        operator.click('record')
        operator.wait(lambda: recording.elapsed_s > 3.0, 'it records')
        before = nodes()
        disk.fill(pid('bag_recorder'))
        operator.wait(lambda: 'The recording has ended by itself' in operator.messages(),
                      'a message', instead=operator.messages)
        assert 'MB are free' in operator.messages() or 'make room' in operator.messages()
        assert operator.window.statusBar().currentMessage() == operator.messages()
        close_message(operator)
        assert (recording.phase, nodes()) == (Phase.IDLE, before)
        assert operator.text('status').startswith(REALTIME)
        [bag] = folder.glob('*.bag')
        assert read_catalogue([str(bag)]).duration_s > 1.0


def close_while_recording(operator: Operator, folder: Path) -> str:
    recording = operator.launcher.recording
    recording.choices.set_folder(str(folder))
    operator.wait(lambda: operator.widget('record').isEnabled(), 'it can record')
    operator.click('record')
    operator.wait(lambda: recording.phase is Phase.RECORDING, 'it records')
    before = nodes()
    operator.window.close()
    question = operator.widget('question', QMessageBox)
    assert 'A recording is in progress' in question.text()
    question.button(QMessageBox.Cancel).click()
    operator.wait(lambda: recording.elapsed_s > 2.0, 'it goes on')
    assert operator.window.isVisible()
    assert nodes() == before
    operator.click('record')
    operator.wait(lambda: recording.phase is Phase.IDLE, 'it has stopped')
    [bag] = folder.glob('*.bag')
    return str(bag)


def quit_all(operator: Operator) -> None:
    operator.click('launch')
    operator.wait(lambda: operator.text('status') == IDLE, 'everything has ended', LAUNCH_S)
    assert nodes() == {'/process_visualizer', '/rosout'}


def bag_of_other_devices(operator: Operator, path: Path) -> None:
    with rosbag.Bag(str(path), 'w') as bag:
        for number in range(20):
            time = Time.from_sec(1000.0 + 0.1 * number)
            bag.write('/feed_rate_est', Float64(number), time)
            bag.write('/foreign', String('hello'), time)
    operator.click('playback')
    operator.launcher.bag.open([str(path)])
    operator.wait(lambda: operator.launcher.bag.path == str(path), 'the bag is open')
    assert operator.launcher.bag.missing == {'sensors': ('/edge_finder_upper',)}
    assert 'edge_finder_upper' in operator.text('bag_warnings')
    operator.click('launch')
    operator.wait(lambda: operator.text('status').startswith('In playback mode.'), 'it plays',
                  LAUNCH_S)
    assert '/bag_player' in nodes()


def bag_in_two_files(operator: Operator, folder: Path) -> None:
    """The value is the number of tenths of a second since the beginning."""
    paths = [str(folder / 'seam_0.bag'), str(folder / 'seam_1.bag')]
    for first, path in zip((0, 50), paths):
        with rosbag.Bag(path, 'w') as bag:
            for number in range(first, first + 50):
                bag.write('/feed_rate_est', Float64(number), Time.from_sec(2000.0 + 0.1 * number))
    heard: List[float] = []
    listener = rospy.Subscriber('/feed_rate_est', Float64, lambda it: heard.append(it.data))
    playback = operator.launcher.playback
    operator.launcher.bag.open(list(reversed(paths)))
    operator.wait(lambda: playback.is_available and playback.duration_s == pytest.approx(9.9),
                  'both files are open', LAUNCH_S)
    operator.wait(lambda: heard[-1:] != [] and heard[-1] < 50, 'the first file is heard')
    operator.wait(lambda: operator.widget('play').isEnabled(), 'it can be moved')
    timeline = operator.widget('timeline')
    place = QPoint(round(0.75 * timeline.width()), 40)
    operator.drag(timeline, place, [place])
    operator.wait(lambda: heard[-1] > 70, 'the second file is heard', instead=lambda: heard[-3:])
    listener.unregister()


def bag_is_deleted(operator: Operator, path: str) -> None:
    operator.launcher.bag.open([path])
    operator.wait(lambda: operator.launcher.bag.path == path, 'the other bag is open')
    operator.wait(lambda: operator.text('status').startswith('In playback mode.'), 'it plays',
                  LAUNCH_S)
    os.remove(path)
    operator.wait(lambda: 'has been deleted or moved' in operator.messages(), 'a message')
    close_message(operator)
    assert '/bag_player' in nodes()
    assert operator.window.isVisible()


def the_master_hangs(operator: Operator) -> None:
    """The window lives, and knows when the master answers again."""
    os.kill(master(), signal.SIGSTOP)
    wait_for_question(operator, 'The ROS master no longer answers')
    assert operator.text('status').endswith('The ROS master no longer answers')
    status_bar = operator.window.statusBar()
    assert status_bar.currentMessage() == 'The ROS master no longer answers'
    operator.widget('question', QMessageBox).button(QMessageBox.Cancel).click()
    for is_chosen in (False, True):
        operator.click_check_box(devices(operator), devices(operator).topLevelItem(1))
        chosen = [device.name for device in operator.launcher.cell.chosen]
        assert chosen == ['sensors', 'table'][:1 + is_chosen]
    os.kill(master(), signal.SIGCONT)
    operator.wait(lambda: status_bar.currentMessage() == 'The ROS master answers again',
                  'it is back')
    assert 'master' not in operator.text('status')


def master() -> int:
    """The process of the master."""
    [line] = [it for it in processes('GUI_TEST_MARK') if '/rosmaster' in it]
    return int(line.split()[0])


def wait_for_question(operator: Operator, text: str) -> None:
    operator.wait(lambda: operator.window.findChild(QMessageBox, 'question') is not None,
                  'the question')
    assert text in operator.widget('question', QMessageBox).text()
    assert operator.window.isVisible()


def the_master_is_killed(operator: Operator) -> None:
    os.kill(master(), signal.SIGKILL)
    wait_for_question(operator, 'The ROS master no longer answers')
    operator.click('yes')
    operator.wait(lambda: not operator.window.isVisible(), 'the nodes have ended', LAUNCH_S)
    assert operator.window.restarts
    operator.close()
