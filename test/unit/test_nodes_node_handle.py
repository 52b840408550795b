# SPDX-License-Identifier: BSD-3-Clause
"""What tests hand in instead of the handle of a node has all of it, by the same names."""
from __future__ import annotations

import inspect
from typing import List

import pytest
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
