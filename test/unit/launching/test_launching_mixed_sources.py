# SPDX-License-Identifier: BSD-3-Clause
"""A recording next to live drivers, and live devices next to a player: refused, with names."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List

import pytest

from process_visualizer.cell.model import Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.generate.choice import Choice
from process_visualizer.health import other_publishers as module
from process_visualizer.health.other_publishers import (
    MixedSources,
    OtherPublisher,
    others_before,
    others_beside,
    refuse_mixture,
)

CELL = """<visualizer><device type="other" name="oven">
  <base frame="oven"/><topic ns="oven" name="heat"/><topic ns="/" name="tf"/>
</device></visualizer>"""
ROSBAG_PLAY = ['pause_playback']
BAG_PLAYER = ['seek', 'set_loop', 'set_rate', 'play']


class Master:
    """Master that knows publishers and services."""

    def __init__(self) -> None:
        self.publishers: Dict[str, List[str]] = {}
        self.services: Dict[str, List[str]] = {}
        self.is_there = True

    def getSystemState(self) -> List[Any]:
        if not self.is_there:
            raise ConnectionRefusedError('no master')
        return [list(map(list, self.publishers.items())), [],
                [[name, nodes] for name, nodes in self.services.items()]]

    def publish(self, topic: str, node: str, services: List[str]) -> None:
        """Let a node publish a topic, and offer services in its namespace."""
        self.publishers.setdefault(topic, []).append(node)
        self.services.update({f'{node}/{name}': [node] for name in services})


@pytest.fixture
def master(monkeypatch: pytest.MonkeyPatch) -> Master:
    found = Master()
    monkeypatch.setattr(module, 'MasterClient', lambda *_, **__: found)
    monkeypatch.setattr(module, 'is_registered', lambda node: node != '/killed_driver')
    return found


@pytest.fixture
def choices(tmp_path: Path) -> Dict[Mode, Choice]:
    """Choices of an oven: live, and from a recording."""
    path = tmp_path / 'cell.xml'
    path.write_text(CELL)
    cell = XmlParser({}).parse(str(path))
    return {mode: Choice(cell, mode, cell.devices,
                         bag='/seam.bag' if mode is Mode.PLAYBACK else None) for mode in Mode}


def test_no_recording_is_played_beside_a_driver(master: Master,
                                                choices: Dict[Mode, Choice]) -> None:
    master.publish('/oven/heat', '/oven_driver', [])
    with pytest.raises(MixedSources, match=r'/oven/heat is published by /oven_driver: .*\. Stop '
                                           'that node first.*--prefix'):
        refuse_mixture(choices[Mode.PLAYBACK])


def test_a_driver_that_was_killed_or_publishes_else_is_no_reason(
        master: Master, choices: Dict[Mode, Choice]) -> None:
    master.publish('/oven/heat', '/killed_driver', [])
    master.publish('/fan/speed', '/oven_driver', [])
    refuse_mixture(choices[Mode.PLAYBACK])


def test_drivers_are_welcome_in_real_time(master: Master, choices: Dict[Mode, Choice]) -> None:
    master.publish('/oven/heat', '/oven_driver', [])
    refuse_mixture(choices[Mode.REALTIME])
    assert others_beside(choices[Mode.REALTIME], set()) == ()


@pytest.mark.parametrize('services', [ROSBAG_PLAY, BAG_PLAYER])
def test_real_time_is_not_mixed_with_a_player(master: Master, choices: Dict[Mode, Choice],
                                              services: List[str]) -> None:
    master.publish('/oven/heat', '/some_player', services)
    with pytest.raises(MixedSources, match='/oven/heat is published by /some_player, which plays '
                                           r'a recording: .*\. Stop that player first'):
        refuse_mixture(choices[Mode.REALTIME])
    assert others_beside(choices[Mode.REALTIME], set()) == (
        OtherPublisher('/oven/heat', '/some_player'),)


def test_beside_a_played_cell_only_shared_topics_are_watched(master: Master,
                                                             choices: Dict[Mode, Choice]) -> None:
    master.publish('/oven/heat', '/oven_driver', [])  # reported by the player
    master.publish('/tf', '/oven_driver', [])
    master.publish('/tf', '/bag_player', [])
    assert others_beside(choices[Mode.PLAYBACK], {'/bag_player'}) == (
        OtherPublisher('/tf', '/oven_driver'),)


def test_without_a_master_there_is_nobody(master: Master, choices: Dict[Mode, Choice]) -> None:
    master.is_there = False
    assert others_before(choices[Mode.PLAYBACK]) == others_before(choices[Mode.REALTIME]) == ()
    with pytest.raises(ConnectionRefusedError):
        others_beside(choices[Mode.REALTIME], set())
