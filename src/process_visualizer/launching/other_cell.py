# SPDX-License-Identifier: BSD-3-Clause
"""Whether a cell runs already: ROS ends a node when another one of its name begins."""
from __future__ import annotations

import rosgraph

from process_visualizer.launching.ros_api import is_registered
from process_visualizer.ros_names import CELL_FRAMES, SCENE_WATCH

_NODES = (f'/{SCENE_WATCH}', f'/{CELL_FRAMES}')
"""They run with every cell, and with nothing else."""


class OtherCell(Exception):
    """Another cell runs on the master; says how it was seen, and what to do."""


def refuse_other_cell() -> None:
    """Raise OtherCell if a cell runs on the master; takes 6 s at most."""
    node = next((name for name in _NODES if is_registered(name)), None)
    if node is not None:
        raise OtherCell(f'another cell runs already on the master {rosgraph.get_master_uri()} '
                        f'({node} answers), and ROS would end its nodes, its recording too. Stop '
                        'it first, or set ROS_MASTER_URI to another port')
