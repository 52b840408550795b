# SPDX-License-Identifier: BSD-3-Clause
"""``cell serve`` beside the simulated cell: its data for a viewer, and its effect on the cell."""
from __future__ import annotations

import asyncio
import json
import re
import signal
import time
from typing import Any, Callable, Dict, Iterator, List, Optional

import numpy as np
import pytest
import rosgraph
from live_frame_reader import SeenFrame, read_frame
from running import CellRun
from surroundings import PATIENCE_S, free_port
from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect

from process_visualizer.launching.ros_master import RosMaster


class Seen:
    """The data that a viewer has received."""

    def __init__(self) -> None:
        self.layout: Dict[str, Any] = {}
        self.state: Dict[str, Any] = {}
        self.frames: List[SeenFrame] = []

    def take(self, message: Any) -> None:
        if isinstance(message, str):
            found = json.loads(message)
            setattr(self, found['kind'], found)
        elif message[0] == 1:
            self.frames.append(read_frame(self.layout, message))


def watched(url: str, is_enough: Callable[[Seen], bool]) -> Seen:
    """Connect as a viewer until enough data has arrived."""
    async def watch() -> Seen:
        connection = await websocket_connect(HTTPRequest(
            url.replace('http', 'ws', 1) + 'live',
            headers={'Origin': '/'.join(url.split('/')[:3])}))
        seen, count = Seen(), 0
        while not is_enough(seen):
            message = await connection.read_message()
            assert message is not None, 'the connection has ended'
            seen.take(message)
            count += 1
            await connection.write_message(str(count))
        connection.close()
        return seen
    return asyncio.run(asyncio.wait_for(watch(), PATIENCE_S))


class Served:
    """A running ``cell serve``, and its address."""

    def __init__(self, config: str, environment: Dict[str, str], *options: str) -> None:
        self.port = free_port()
        self.run = CellRun(['serve', config, '--port', str(self.port), *options], environment)
        self.url = self.run.wait_for_line('http').strip()


@pytest.fixture(scope='module')
def cell(ros_environment: Dict[str, str], master: RosMaster,
         simulated_config: str) -> Iterator[CellRun]:
    run = CellRun(['run', simulated_config, '--no-rviz'], ros_environment)
    run.wait_for_line('/bag_recorder: running')
    yield run
    run.end()


@pytest.fixture(scope='module')
def served(cell: CellRun, ros_environment: Dict[str, str],
           simulated_config: str) -> Iterator[Served]:
    found = Served(simulated_config, ros_environment, '--address', '127.0.0.1')
    yield found
    found.run.end()


def test_without_a_running_cell_it_says_what_to_do(ros_environment: Dict[str, str],
                                                   simulated_config: str) -> None:
    environment = {**ros_environment, 'ROS_MASTER_URI': f'http://localhost:{free_port()}'}
    run = CellRun(['serve', simulated_config], environment)
    assert run.wait() == 1
    assert 'no cell is running on the ROS master' in run.text
    assert 'Traceback' not in run.text


def test_a_viewer_sees_robots_numbers_and_curves(served: Served) -> None:
    def is_enough(seen: Seen) -> bool:
        return (len(seen.frames) > 50 and len(seen.state.get('lanes', ())) >= 7
                and len(seen.frames[-1].texts) >= 7)

    seen = watched(served.url, is_enough)
    moving = {name.split('/')[0] for name in seen.frames[-1].places}
    assert moving >= {'ur_rt_upper', 'ur_rt_lower'}
    places = np.array([it.places['ur_rt_upper/link6'][0] for it in seen.frames[-30:]
                       if 'ur_rt_upper/link6' in it.places])
    assert np.isfinite(places).all()
    words = [text for _, text in seen.frames[-1].texts.values()]
    assert any(re.fullmatch(r'v \d\.\d{3} m/s', it) for it in words), words
    assert any(re.fullmatch(r'F \d+\.\d N', it) for it in words), words
    assert seen.state['problem'] is None
    assert seen.state['recording'] == 'not recording'


def test_its_node_publishes_nothing_but_its_log(served: Served) -> None:
    publishers, _, services = rosgraph.Master('/test').getSystemState()
    own = [topic for topic, nodes in publishers if any('cell_serve' in it for it in nodes)]
    assert own == ['/rosout']
    offered = [name for name, nodes in services if any('cell_serve' in it for it in nodes)]
    assert [it.rpartition('/')[2] for it in offered] == ['get_loggers', 'set_logger_level']


def test_a_port_that_is_taken_is_said(served: Served, ros_environment: Dict[str, str],
                                      simulated_config: str) -> None:
    run = CellRun(['serve', simulated_config, '--port', str(served.port)], ros_environment)
    assert run.wait() == 1
    assert f'another program has port {served.port}' in run.text


def test_the_page_ends_and_the_cell_goes_on_and_the_other_way_around(
        served: Served, cell: CellRun, ros_environment: Dict[str, str],
        simulated_config: str) -> None:
    other = Served(simulated_config, ros_environment)
    watched(other.url, lambda seen: len(seen.frames) > 5)
    assert other.run.signal_and_wait(signal.SIGINT) == 0
    assert 'Traceback' not in other.run.text
    watched(served.url, lambda seen: len(seen.frames) > 5)
    assert cell.signal_and_wait(signal.SIGINT) == 0

    def problem(seen: Seen) -> Optional[str]:
        return (seen.state.get('problem') or {}).get('text')

    watched(served.url, lambda seen: problem(seen) == 'The cell does not run')
    again = CellRun(['run', simulated_config, '--no-rviz'], ros_environment)
    try:
        begin_s = time.time()
        seen = watched(served.url, lambda seen: bool(seen.state) and problem(seen) is None)
        assert [it['text'] for it in seen.state['events'] if it['time'] > begin_s - 60.0][:1] == [
            'The cell answers again']
    finally:
        again.end()
