# SPDX-License-Identifier: BSD-3-Clause
"""What tests hand in instead of the handle of a node has all of it, by the same names."""
from __future__ import annotations

import inspect
from typing import List

import pytest
from rospy import AnyMsg
from simulated_node import SimulatedNode

from process_visualizer.nodes.common.node_handle import NodeHandle

OF_PLAYER = 'thread'  # only the player has threads of its own, whose turns simulated_player takes
NAMES = [name for name, value in vars(NodeHandle).items()
         if inspect.isfunction(value) and not name.startswith('_') and name != OF_PLAYER]


def parameters(owner: type, name: str) -> List[str]:
    return [it.lstrip('_') for it in inspect.signature(getattr(owner, name)).parameters]


@pytest.mark.parametrize('name', NAMES)
def test_the_simulated_node_takes_the_same(name: str) -> None:
    assert parameters(SimulatedNode, name) == parameters(NodeHandle, name)


@pytest.mark.parametrize('name', ['/arm\x1b[31m/joint_states', '/arm\n', '/a\ud800', '/\u202e', ''])
def test_a_name_that_rospy_would_repeat_for_ever_is_refused(name: str) -> None:
    """A subscriber with it kept the lock that all others of the node need."""
    node = NodeHandle()
    for use in (lambda: node.subscribe(name, AnyMsg, lambda _: None), lambda: node.param(name)):
        with pytest.raises(ValueError, match='is no name of a topic or parameter'):
            use()
