# SPDX-License-Identifier: BSD-3-Clause
"""Requests to a master: it answers, refuses, hangs, or does not exist."""
from __future__ import annotations

import socket
import threading
from contextlib import contextmanager
from typing import Any, Iterator
from xmlrpc.server import SimpleXMLRPCServer

import pytest
import rosgraph

from process_visualizer.launching.ros_api import MasterClient, forget_ended, process_id_at


@contextmanager
def served(**functions: Any) -> Iterator[str]:
    with SimpleXMLRPCServer(('127.0.0.1', 0), logRequests=False) as server:
        for name, function in functions.items():
            server.register_function(function, name)
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield f'http://127.0.0.1:{server.server_address[1]}/'
        server.shutdown()
        thread.join()


def test_what_it_answers_and_refuses(monkeypatch: pytest.MonkeyPatch) -> None:
    told = []
    with served(lookupNode=lambda caller, node: [1, '', f'{caller} {node}'],
                getSystemState=lambda caller: [-1, 'not now', 0],
                setParam=lambda *values: [1, '', told.append(values) or 0]) as uri:
        monkeypatch.setenv('ROS_MASTER_URI', uri)
        master = MasterClient('/me')
        assert master.lookupNode('/a') == '/me /a'
        master.setParam('/a/seen', ['/b'])
        assert told == [('/me', '/a/seen', ['/b'])]
        with pytest.raises(rosgraph.MasterException, match='not now'):
            master.getSystemState()


def test_one_that_hangs_or_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(('127.0.0.1', 0)) as server:
        monkeypatch.setenv('ROS_MASTER_URI', f'http://127.0.0.1:{server.getsockname()[1]}/')
        with pytest.raises(OSError):
            MasterClient('/me').lookupNode('/a')
    with pytest.raises(OSError):
        MasterClient('/me').getSystemState()
    with served(getSystemState=lambda caller: 'text') as uri:
        monkeypatch.setenv('ROS_MASTER_URI', uri)
        with pytest.raises(OSError):
            MasterClient('/me').getSystemState()


@pytest.mark.parametrize('value', [5, {'a': 1}, 'text', [[[1]], 'a'], '\x07'])
def test_one_that_answers_nonsense(value: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of another type, or with content that XML does not allow."""
    def answer(_caller: str) -> 'list[object]':
        return [1, '', value]

    with served(getPid=answer, getSystemState=answer, getTopicTypes=answer,
                getParamNames=answer) as uri:
        monkeypatch.setenv('ROS_MASTER_URI', uri)
        master = MasterClient('/me')
        asked = [] if value == 5 else [master.getPid]
        asked += [] if isinstance(value, list) else [
            master.getSystemState, master.getTopicTypes, master.getParamNames]
        for ask in asked:
            with pytest.raises((OSError, rosgraph.MasterException)):
                ask()
        if value != 5:
            with pytest.raises((OSError, ValueError)):
                process_id_at(uri)


def test_nodes_that_have_ended_are_forgotten_and_no_others() -> None:
    with socket.create_server(('127.0.0.1', 0)) as server:
        gone = f'http://127.0.0.1:{server.getsockname()[1]}/'
    told = []

    def tell(*values: str) -> 'list[object]':
        told.append(values)
        return [1, '', 1]

    with served(getPid=lambda caller: [1, '', 5]) as alive, served(
            getSystemState=lambda caller: [1, '', [
                [['/force', ['/dead', '/living']], ['/rosout', ['/other']]],
                [['/clock', ['/dead']]], [['/dead/stop', ['/dead']]]]],
            lookupNode=lambda caller, node: [1, '', alive if node == '/living' else gone],
            lookupService=lambda caller, service: [1, '', 'rosrpc://here:1'],
            unregisterPublisher=tell, unregisterSubscriber=tell, unregisterService=tell) as uri:
        assert forget_ended(['/dead', '/living', '/unknown'], uri) == ['/dead']
    assert told == [('/dead', '/clock', gone), ('/dead', '/force', gone),
                    ('/dead', '/dead/stop', 'rosrpc://here:1')]
    assert forget_ended(['/dead'], uri) == []  # no master
