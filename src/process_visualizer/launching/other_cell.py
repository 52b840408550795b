# SPDX-License-Identifier: BSD-3-Clause
"""Detection of another cell: ROS ends a node when another of the same name starts."""
from __future__ import annotations

import rosgraph

from process_visualizer.launching.ros_api import is_registered
from process_visualizer.ros_names import CELL_FRAMES, SCENE_WATCH

_NODES = (f'/{SCENE_WATCH}', f'/{CELL_FRAMES}')
"""They run with every cell, and only with a cell."""


class OtherCell(Exception):
    """Another cell is running on the master; says how it was detected, and what to do."""


def refuse_other_cell() -> None:
    """Raise OtherCell if a cell is running on the master; takes at most 6 s."""
    node = next((name for name in _NODES if is_registered(name)), None)
    if node is not None:
        raise OtherCell('another cell is already running on the master '
                        f'{rosgraph.get_master_uri()} '
                        f'({node} answers); ROS would end its nodes and its recording. To '
                        'watch it: "rosrun process_visualizer cell view". To run another one, '
                        'stop it first, or set ROS_MASTER_URI to another port')
