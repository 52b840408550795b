# SPDX-License-Identifier: BSD-3-Clause
"""Messages to the operator when a node or the master ends or hangs."""
from __future__ import annotations

import os
import signal
import subprocess
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Iterator, Set
from urllib.parse import urlsplit

import pytest
from operator_at_work import Operator, processes
from PyQt5.QtWidgets import QMessageBox
from running_program import SMALL_CELL

from process_visualizer.gui.cell.devices_panel import DevicesView
from process_visualizer.gui.recording.recording_types import RecordingPhase

REALTIME = 'In real-time mode.'


@pytest.fixture
def operator(qtbot: Any) -> Iterator[Operator]:
    person = Operator(qtbot)
    yield person
    person.close()


def test_troubles(operator: Operator, tmp_path: Path) -> None:
    launch(operator, tmp_path / 'cell.xml')
    a_node_is_killed(operator)
    the_recorder_hangs(operator, tmp_path)
    the_master_hangs(operator)
    record(operator, tmp_path)
    the_master_is_killed(operator)
    with another_master():
        the_master_was_started_anew(operator)
    assert {it for it in processes('GUI_TEST_MARK') if 'Xvfb' not in it} == set()


def launch(operator: Operator, config: Path) -> None:
    config.write_text(SMALL_CELL)
    operator.launcher.cell.open(str(config))
    operator.wait(lambda: operator.widget('launch').isEnabled(), 'it can be launched')
    operator.click('launch')
    operator.wait(lambda: operator.text('status').startswith(REALTIME), 'all is up')


def devices(operator: Operator) -> DevicesView:
    return operator.widget('devices', DevicesView)


def pid(node: str) -> int:
    """Return the process of a node, by its name without namespace."""
    [line] = [it for it in processes('GUI_TEST_MARK') if f'__name:={node} ' in it]
    return int(line.split()[0])


def pids(*node_names: str) -> Set[int]:
    return {pid(node) for node in node_names}


def a_node_is_killed(operator: Operator) -> None:
    others = pids('simulator', 'bag_recorder')
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
    assert pids('simulator', 'bag_recorder') == others


def the_recorder_hangs(operator: Operator, folder: Path) -> None:
    """It continues to record as soon as it can, and there is no request to end it."""
    recording, recorder = operator.launcher.recording, pid('bag_recorder')
    recording.choices.set_folder(str(folder))
    operator.wait(lambda: operator.widget('record').isEnabled(), 'it can record')
    operator.click('record')
    operator.wait(lambda: recording.elapsed_s > 0.5, 'recording')
    os.kill(recorder, signal.SIGSTOP)
    operator.wait(lambda: operator.text('record_notice').startswith(
        'The recorder is not responding. It may still be recording.'), 'it says nothing')
    assert recording.phase is RecordingPhase.RECORDING and operator.messages() == ''
    assert operator.text('record') == 'Stop' and operator.widget('record').isEnabled()
    os.kill(recorder, signal.SIGCONT)
    operator.wait(lambda: operator.text('record_notice').startswith('Into '), 'it responds')
    operator.click('record')
    operator.wait(lambda: recording.phase is RecordingPhase.IDLE, 'recorded')
    assert operator.messages() == '' and len(list(folder.glob('*.bag'))) == 1


def the_master_hangs(operator: Operator) -> None:
    """The window keeps working, and notices when the master answers again."""
    os.kill(master(), signal.SIGSTOP)
    wait_for_offer(operator, 'The ROS master is not responding')
    assert operator.text('status').startswith('The ROS master is not responding')
    status_bar = operator.window.statusBar()
    assert status_bar.currentMessage() == 'The ROS master is not responding'
    for is_chosen in (False, True):
        operator.click_check_box(devices(operator), devices(operator).topLevelItem(1))
        chosen = [device.name for device in operator.launcher.session.chosen]
        assert chosen == ['sensors', 'table'][:1 + is_chosen]
    os.kill(master(), signal.SIGCONT)
    operator.wait(lambda: status_bar.currentMessage() == 'The ROS master responds again',
                  'it is back')
    assert 'master' not in operator.text('status')


def master() -> int:
    """Return the process of the master."""
    [line] = [it for it in processes('GUI_TEST_MARK') if '/rosmaster' in it]
    return int(line.split()[0])


def wait_for_offer(operator: Operator, text: str) -> None:
    operator.wait(lambda: operator.widget('lost_master_remedy').isVisible()
                  and operator.text('lost_master_text').startswith(text), 'the offer')


def wait_for_question(operator: Operator, text: str) -> None:
    operator.wait(lambda: operator.window.findChild(QMessageBox, 'question') is not None,
                  'the question')
    assert text in operator.widget('question', QMessageBox).text()
    assert operator.window.isVisible()


def cancel(operator: Operator) -> None:
    operator.widget('question', QMessageBox).button(QMessageBox.Cancel).click()
    operator.wait(lambda: operator.window.findChild(QMessageBox, 'question') is None, 'it is gone')


def record(operator: Operator, folder: Path) -> None:
    operator.launcher.recording.choices.set_folder(str(folder))
    operator.wait(lambda: operator.widget('record').isEnabled(), 'ready to record')
    operator.click('record')
    operator.wait(lambda: operator.launcher.recording.phase is RecordingPhase.RECORDING,
                  'it records')


def the_master_is_killed(operator: Operator) -> None:
    os.kill(master(), signal.SIGKILL)
    wait_for_offer(operator, 'The ROS master is not responding')


@contextmanager
def another_master() -> Iterator[None]:
    """Run another master in place of the killed one."""
    port = str(urlsplit(os.environ['ROS_MASTER_URI']).port)
    process = subprocess.Popen(['rosmaster', '--core', '-p', port], stdout=subprocess.DEVNULL)
    yield
    process.terminate()
    process.wait()


def the_master_was_started_anew(operator: Operator) -> None:
    """It knows no node, but the recording can be ended, and the launcher can launch again."""
    anew = 'The ROS master was restarted'
    wait_for_offer(operator, anew)
    operator.click('lost_master_remedy')
    wait_for_question(operator, anew)
    cancel(operator)
    assert operator.text('status').startswith(f'{anew} and does not know the running nodes')
    operator.click('record')
    operator.wait(lambda: operator.launcher.recording.phase is RecordingPhase.IDLE, 'recorded')
    assert operator.messages() == ''
    operator.click('launch')
    operator.wait(lambda: operator.launcher.launch.is_idle, 'all nodes have quit')
    wait_for_offer(operator, anew)
    operator.click('launch')
    wait_for_question(operator, f'{anew}. Nothing can be launched until')
    operator.click('yes')
    operator.wait(lambda: not operator.window.isVisible(), 'it closes')
    assert operator.window.restarts
    operator.close()
