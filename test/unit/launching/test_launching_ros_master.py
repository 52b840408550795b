# SPDX-License-Identifier: BSD-3-Clause
"""Messages about masters that the launcher cannot use; nothing here starts one."""
from __future__ import annotations

import os
import socket
import threading
from pathlib import Path
from typing import Callable, Iterator
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from process_visualizer.launching.ros_master import RosMaster, RosMasterError


def error_of(master: RosMaster) -> str:
    assert master.is_online() is False
    with pytest.raises(RosMasterError) as caught:
        master.ensure()
    master.stop()
    return str(caught.value)


@pytest.fixture
def listener() -> Iterator[socket.socket]:
    """A listening socket."""
    with socket.create_server(('127.0.0.1', 0)) as server:
        yield server


def uri_of(server: socket.socket) -> str:
    return f'http://127.0.0.1:{server.getsockname()[1]}'


@pytest.fixture
def xml_rpc() -> Iterator[SimpleXMLRPCServer]:
    """An XML-RPC server without functions."""
    server = SimpleXMLRPCServer(('127.0.0.1', 0), logRequests=False)
    thread = threading.Thread(target=server.serve_forever, kwargs={'poll_interval': 0.02})
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


def test_master_that_is_there(xml_rpc: SimpleXMLRPCServer) -> None:
    xml_rpc.register_function(lambda caller: [1, '', 7], 'getPid')
    master = RosMaster(uri_of(xml_rpc.socket))
    assert master.is_online() is True
    assert master.ensure() is False
    master.stop()
    assert master.is_online() is True


@pytest.mark.parametrize('answer', [lambda caller: [-1, 'no', 0], lambda caller: 'what?',
                                    lambda: 1])
def test_another_program_with_xml_rpc(answer: Callable[..., object],
                                      xml_rpc: SimpleXMLRPCServer) -> None:
    xml_rpc.register_function(answer, 'getPid')
    message = error_of(RosMaster(uri_of(xml_rpc.socket)))
    assert message == (f'something other than a ROS master listens at {uri_of(xml_rpc.socket)}; '
                       'stop it, or set ROS_MASTER_URI to another port')


def test_server_of_something_else(listener: socket.socket) -> None:
    def answer() -> None:
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:  # the test is over
                return
            with connection:
                connection.recv(65536)
                connection.sendall(b'220 mail.example.org\r\n')

    threading.Thread(target=answer, daemon=True).start()
    assert 'something other than a ROS master listens at' in error_of(RosMaster(uri_of(listener)))


def test_a_master_that_takes_too_long_is_told_as_such(tmp_path: Path,
                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    """The message is not the master's output on shutdown."""
    roslaunch = tmp_path / 'roslaunch'
    roslaunch.write_text('#!/bin/sh\nexec sleep 60\n')
    roslaunch.chmod(0o755)
    monkeypatch.setenv('PATH', f'{tmp_path}{os.pathsep}{os.environ["PATH"]}')
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    with socket.create_server(('127.0.0.1', 0)) as server:
        uri = uri_of(server)
    with pytest.raises(RosMasterError, match='did not start within 0 s: the computer is too busy'):
        RosMaster(uri, start_timeout_s=0.0).ensure()


def test_server_that_never_answers(listener: socket.socket) -> None:
    assert 'something other than a ROS master listens at' in error_of(RosMaster(uri_of(listener)))


def test_master_on_another_computer() -> None:
    message = error_of(RosMaster('http://no-such-computer.invalid:11311'))
    assert message.startswith('the ROS master at http://no-such-computer.invalid:11311 does not '
                              'answer (')
    assert message.endswith('start roscore on "no-such-computer.invalid", or set ROS_MASTER_URI '
                            'to http://localhost:11311')


@pytest.mark.parametrize('uri', ['localhost', 'http://localhost', 'http://:11311', 'nonsense://',
                                 'http://localhost:port', 'http://localhost:99999999'])
def test_address_that_is_none(uri: str) -> None:
    assert error_of(RosMaster(uri)) == (f'ROS_MASTER_URI is "{uri}"; it must look like '
                                        'http://localhost:11311')


def test_address_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('ROS_MASTER_URI', 'http://localhost:1234')
    assert RosMaster().uri == 'http://localhost:1234'


def test_without_roslaunch(listener: socket.socket, monkeypatch: pytest.MonkeyPatch,
                           tmp_path: object) -> None:
    uri = uri_of(listener)
    listener.close()
    monkeypatch.setenv('PATH', str(tmp_path))
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    assert error_of(RosMaster(uri)).startswith(
        'roscore cannot be started: there is no roslaunch on PATH')


def test_logs_that_cannot_be_written(listener: socket.socket, monkeypatch: pytest.MonkeyPatch,
                                     tmp_path: Path) -> None:
    """rosmaster would end with a traceback; root may write into every folder, so this is a file."""
    uri = uri_of(listener)
    listener.close()
    folder = tmp_path / 'log'
    folder.write_text('')
    monkeypatch.setenv('ROS_LOG_DIR', str(folder))
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    said = error_of(RosMaster(uri))
    assert 'ROS cannot write its logs' in said and 'set ROS_LOG_DIR' in said
    assert str(folder) in said
    assert not (tmp_path / 'process_visualizer').exists(), 'nothing is left'
