# SPDX-License-Identifier: BSD-3-Clause
"""The watcher, fed with roslaunch output; with no master, or a small one."""
from __future__ import annotations

import socket
import threading
from pathlib import Path
from typing import Any, Iterator, List, Tuple
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from process_visualizer.health.device_state import node_line
from process_visualizer.launching.cell_owner import OtherCell, refuse_other_cell
from process_visualizer.launching.part_report import NodeReport, NodeState
from process_visualizer.launching.ros_api import is_registered
from process_visualizer.launching.run import NodeWatcher
from process_visualizer.ros_names import CELL_FRAMES, SCENE_WATCH

REQUIRED = ['=' * 80 + 'REQUIRED process [rviz-2] has died!\n',
            'process has died [pid 5, exit code 3, cmd /opt/rviz].\n', 'log file: /x/rviz*.log\n',
            'Initiating shutdown!\n', '=' * 80 + '\n', '[rviz-2] killing on exit\n']


@pytest.fixture(autouse=True)
def no_master(monkeypatch: pytest.MonkeyPatch) -> None:
    """The address of a master that does not exist."""
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        port = probe.getsockname()[1]
    monkeypatch.setenv('ROS_MASTER_URI', f'http://127.0.0.1:{port}')


class LittleMaster(SimpleXMLRPCServer):
    """Master that knows nodes by name, as a ROS master does, and answers for each of them."""

    def __init__(self) -> None:
        super().__init__(('127.0.0.1', 0), logRequests=False, allow_none=True)
        self.nodes: List[str] = []
        self.uri = f'http://127.0.0.1:{self.server_address[1]}'
        self.node_uri = self.uri
        self.register_function(self.answer, 'lookupNode')
        self.register_function(lambda caller: (1, '', 7), 'getPid')

    def answer(self, *arguments: Any) -> Tuple[int, str, str]:
        """The master's answer to a caller (first) that asks for a node (second)."""
        known = arguments[1] in self.nodes
        return (1, 'node api', self.node_uri) if known else (-1, 'unknown node', '')


@pytest.fixture
def master(monkeypatch: pytest.MonkeyPatch) -> Iterator[LittleMaster]:
    """A running master without nodes."""
    server = LittleMaster()
    monkeypatch.setenv('ROS_MASTER_URI', server.uri)
    thread = threading.Thread(target=server.serve_forever, kwargs={'poll_interval': 0.02})
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


def watch(*lines: str) -> Tuple[NodeWatcher, List[NodeReport], List[str]]:
    reports: List[NodeReport] = []
    seen: List[str] = []
    watcher = NodeWatcher(reports.append, seen.append)
    watcher.watch(lines)
    return watcher, reports, seen


def started(name: str) -> str:
    return f'\033[1mprocess[{name}]: started with pid [7]\033[0m\n'


def test_every_line_is_handed_on_plainly() -> None:
    assert watch(started('a-1'), 'some text\n', '\n')[2] == [
        'process[a-1]: started with pid [7]', 'some text', '']


def test_nothing_is_written() -> None:
    watcher, reports, seen = watch()
    assert (watcher.reports(), watcher.failed_required, reports, seen) == ([], None, [], [])


def test_reports_of_a_restarted_node() -> None:
    watcher, reports, _ = watch(
        started('d/a-1'), started('b-2'), '[d/a-1] process has died [pid 7, exit code 9, cmd x].\n',
        '[d/a-1] restarting process\n', started('d/a-1'), '[b-2] process has finished cleanly\n')
    assert [str(report) for report in reports] == [
        '/d/a: starting', '/b: starting', '/d/a: ended with code 9',
        '/d/a: starting (restarted 1 time)', '/b: ended with code 0']
    assert {report.name: report.state for report in watcher.reports()} == {
        '/d/a': NodeState.STARTING, '/b': NodeState.EXITED}


def test_a_node_whose_name_another_one_has_taken(master: LittleMaster) -> None:
    """ROS ends the first one, which looks like a normal end."""
    master.nodes = ['/b']
    watcher, reports, _ = watch(started('a-1'), started('b-2'),
                                '[a-1] process has finished cleanly\n',
                                '[b-2] process has finished cleanly\n')
    assert str(reports[-1]).startswith('/b: ended with code 0: another node of the same name was '
                                       'started')
    assert [str(it) for it in watcher.reports()][0] == '/a: ended with code 0'
    assert node_line(reports[-1]).text == reports[-1].end_words


def test_a_restarted_node_has_taken_its_own_name() -> None:
    node = NodeReport('/a').started().exited(0).started()
    assert node.replaced() == node


def test_node_that_cannot_be_started() -> None:
    watcher, _, _ = watch('ERROR: cannot launch node of type [p/t]: Cannot locate it\n')
    assert [str(report) for report in watcher.reports()] == [
        'p/t: cannot be started: Cannot locate it']


def test_required_node_died() -> None:
    watcher, reports, _ = watch(started('rviz-2'), *REQUIRED)
    assert str(watcher.failed_required) == '/rviz: ended with code 3'
    assert reports[-1] == watcher.failed_required


def test_required_node_ended_as_it_should() -> None:
    watcher, _, _ = watch(started('rviz-2'), REQUIRED[0], 'process has finished cleanly\n')
    assert watcher.failed_required is not None and watcher.failed_required.exit_code == 0


def test_a_master_of_roslaunch_that_died() -> None:
    """Its name has no number, and all nodes end with it."""
    watcher, _, _ = watch(started('a-1'), '=' * 80 + 'REQUIRED process [master] has died!\n',
                          'process has died [pid 5, exit code -9, cmd rosmaster].\n',
                          'Initiating shutdown!\n')
    assert str(watcher.failed_required) == '/master: killed by SIGKILL'


def test_node_died_while_a_required_one_did() -> None:
    watcher, _, _ = watch(started('a-1'), started('rviz-2'), REQUIRED[0],
                          '[a-1] process has died [pid 7, exit code 9, cmd x].\n', *REQUIRED[1:])
    assert str(watcher.failed_required) == '/rviz: ended with code 3'
    assert {report.name: report.exit_code for report in watcher.reports()} == {
        '/a': 9, '/rviz': 3}


DIED = '[d/a-1] process has died [pid 7, exit code 9, cmd x].\n'


def test_last_lines_of_a_node_that_died() -> None:
    words = [f'word {number}\n' for number in range(30)]
    watcher, reports, _ = watch(started('d/a-1'), *words, DIED, 'log file: /no/d-a-1*.log\n',
                                'later\n')
    assert reports[-1].log_tail == tuple(word.rstrip() for word in words[-20:])
    assert watcher.reports() == [reports[-1]]


def test_first_words_in_the_line_of_the_start() -> None:
    line = started('d/a-1').rstrip('\n') + 'no camera\n'
    reports = watch(line, '\n', DIED)[1]
    assert reports[-1].log_tail == ('no camera', '')


def test_last_lines_of_a_node_that_writes_to_a_file(tmp_path: Path) -> None:
    (tmp_path / 'd-a-1-stdout.log').write_text('first\nsecond\n')
    (tmp_path / 'd-a-1.log').write_text('of rospy\n')
    _, reports, _ = watch(started('d/a-1'), 'error\n', DIED, f'log file: {tmp_path}/d-a-1*.log\n')
    assert reports[-1].log_tail == ('first', 'second', 'error')
    assert (reports[-1].state, reports[-1].exit_code) == (NodeState.EXITED, 9)


def test_last_lines_of_a_required_node(tmp_path: Path) -> None:
    (tmp_path / 'rviz-2-stdout.log').write_text('no screen\n')
    watcher, reports, _ = watch(started('rviz-2'), REQUIRED[0], REQUIRED[1],
                                f'log file: {tmp_path}/rviz-2*.log\n', *REQUIRED[3:])
    assert watcher.failed_required == reports[-1]
    assert reports[-1].log_tail == ('no screen',)


def test_last_lines_stay_with_a_node_that_is_restarted() -> None:
    _, reports, _ = watch(started('d/a-1'), 'error\n', DIED, started('d/a-1'))
    assert (reports[-1].state, reports[-1].log_tail) == (NodeState.STARTING, ('error',))


def test_line_with_an_exit_code_alone_means_nothing() -> None:
    watcher, reports, _ = watch(started('a-1'), *REQUIRED[1:])
    assert watcher.failed_required is None and len(reports) == 1


def test_without_a_master_nothing_is_registered() -> None:
    assert is_registered('/rosout') is False


def test_somebody_else_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(('127.0.0.1', 0)) as server:
        monkeypatch.setenv('ROS_MASTER_URI', f'http://127.0.0.1:{server.getsockname()[1]}')

        def answer() -> None:
            connection, _ = server.accept()
            with connection:
                connection.recv(65536)
                connection.sendall(b'what?\r\n\r\n')

        thread = threading.Thread(target=answer)
        thread.start()
        assert is_registered('/rosout') is False
        thread.join()


def test_master_knows_a_node(master: LittleMaster) -> None:
    master.nodes.append('/a')
    assert is_registered('/a') is True
    assert is_registered('/b') is False


def test_master_knows_a_node_that_is_gone(master: LittleMaster) -> None:
    with socket.create_server(('127.0.0.1', 0)) as server:
        master.node_uri = f'http://127.0.0.1:{server.getsockname()[1]}'
    master.nodes.append('/a')
    assert is_registered('/a') is False


@pytest.mark.parametrize('node', [SCENE_WATCH, CELL_FRAMES])
def test_a_second_cell_on_the_master_is_refused(master: LittleMaster, node: str) -> None:
    master.nodes.append('/rosout')
    refuse_other_cell()
    master.nodes.append(f'/{node}')
    with pytest.raises(OtherCell, match=f'/{node} answers'):
        refuse_other_cell()


def test_started_nodes_run_when_the_master_knows_them(master: LittleMaster) -> None:
    """Nodes that start later, while the watcher does not wait for any, are detected, too."""
    running = threading.Condition()
    known: List[str] = []

    def report(changed: NodeReport) -> None:
        with running:
            if changed.state is NodeState.RUNNING:
                known.append(changed.name)
            running.notify_all()

    def lines() -> Iterator[str]:
        for name in ('a', 'd/b', 'c'):
            yield started(f'{name}-1')
            master.nodes.append(f'/{name}')
            with running:
                assert running.wait_for(lambda: master.nodes[-1] in known, 10)

    watcher = NodeWatcher(report, lambda line: None)
    watcher.watch(lines())
    assert known == ['/a', '/d/b', '/c']
    assert all(found.state is NodeState.RUNNING for found in watcher.reports())


NAMES = ('a', 'd/b', 'rviz')
LINES = st.one_of(
    st.sampled_from(NAMES).map(lambda name: started(f'{name}-1')),
    st.sampled_from(NAMES).map(lambda name: f'[{name}-1] process has finished cleanly\n'),
    st.sampled_from(NAMES).map(
        lambda name: f'[{name}-1] process has died [pid 7, exit code 9, cmd x].\n'),
    st.sampled_from([*REQUIRED, 'ERROR: cannot launch node of type [p/t]: why\n', 'text\n']),
    st.text(max_size=20))


@settings(max_examples=40)
@given(st.lists(LINES, max_size=20))
def test_any_output(lines: List[Any]) -> None:
    watcher, reports, seen = watch(*lines)
    assert len(seen) == len(lines)
    latest = {report.name: report for report in reports}
    assert latest == {report.name: report for report in watcher.reports()}
    assert set(latest) <= {f'/{name}' for name in NAMES} | {'p/t'}
    assert (watcher.failed_required is None
            or watcher.failed_required in reports)
