# SPDX-License-Identifier: BSD-3-Clause
"""The view of somebody who looks at a running cell, and must not change anything in it."""
from __future__ import annotations

from typing import Any, Dict, List

_CHANGING_DISPLAYS = ('process_visualizer/DisplayStatus', 'process_visualizer/ReplayBand',
                      'rviz/InteractiveMarkers')
"""They publish, or are commanded by the launcher of the cell."""
_CHANGING_TOOLS = ('rviz/Interact', 'rviz/SetInitialPose', 'rviz/SetGoal', 'rviz/PublishPoint')


def onlooker_view(config: Dict[str, Any]) -> Dict[str, Any]:
    """Return the content of an .rviz file without what publishes anything."""
    manager = dict(config['Visualization Manager'])
    manager['Displays'] = _without(manager.get('Displays') or [], _CHANGING_DISPLAYS)
    manager['Tools'] = _without(manager.get('Tools') or [], _CHANGING_TOOLS)
    return {**config, 'Visualization Manager': manager}


def _without(items: List[Any], classes: 'tuple[str, ...]') -> List[Any]:
    """The items of other classes, and of groups those inside."""
    return [{**it, 'Displays': _without(it['Displays'], classes)} if it.get('Displays') else it
            for it in items if it.get('Class') not in classes]
