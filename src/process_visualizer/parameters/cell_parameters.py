# SPDX-License-Identifier: BSD-3-Clause
"""The private parameters of the nodes of the whole cell: scene_watch and cell_frames."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Sequence, Tuple

from process_visualizer.cell.elements import DEFAULT_FRAME
from process_visualizer.health.staleness import STALE_AFTER_S
from process_visualizer.parameters.reading import (
    ParameterError,
    Parameters,
    changed,
    shown,
)
from process_visualizer.robot.frames import Frame


@dataclass(frozen=True)
class WatchedDevice:
    """A watched device: the position of its texts, its nodes, and the topics that RViz shows."""

    name: str
    frame: str
    position: Tuple[float, float, float]  # (3,) [m] in the frame
    nodes: Mapping[str, str]  # the consequence of a node's end, by the node's name
    topics: Tuple[str, ...]
    age_topic: str = ''  # topic with the age of the cloud; '' without a cloud

    @staticmethod
    def read(parameters: Parameters) -> WatchedDevice:
        """Return a device from its parameters.

        Raises:
            ParameterError: a value is wrong.
        """
        return WatchedDevice(
            parameters.text('name', ''), parameters.frame('frame', DEFAULT_FRAME),
            parameters.vector('position', (0.0, 0.0, 0.0)),
            parameters.texts('nodes'), tuple(parameters.texts('topics')),
            parameters.text('age_topic', ''))

    def to_parameters(self) -> Dict[str, Any]:
        """Return the parameters that ``read`` reads."""
        return {'name': self.name, 'frame': self.frame, 'position': list(self.position),
                'nodes': dict(self.nodes), 'topics': list(self.topics),
                **changed({'age_topic': self.age_topic}, {'age_topic': ''})}


@dataclass(frozen=True)
class SceneParameters:
    """The parameters of scene_watch: the watched devices."""

    frame: str
    devices: Tuple[WatchedDevice, ...]
    stale_after_s: float = STALE_AFTER_S

    @staticmethod
    def read(parameters: Parameters) -> SceneParameters:
        """Return the checked parameters.

        Raises:
            ParameterError: a value is wrong.
        """
        return SceneParameters(
            parameters.frame('frame', DEFAULT_FRAME),
            tuple(WatchedDevice.read(group) for group in parameters.groups('devices')),
            parameters.number('stale_after', STALE_AFTER_S, above=0.0))

    def to_parameters(self) -> Dict[str, Any]:
        """Return the parameters that ``read`` reads."""
        return {'frame': self.frame,
                'devices': [device.to_parameters() for device in self.devices],
                **changed({'stale_after': self.stale_after_s}, {'stale_after': STALE_AFTER_S})}


_ZERO = (0.0, 0.0, 0.0)


def read_frames(entries: Any) -> List[Frame]:
    """Return the frames of a parameter: a list of dictionaries parent, child, xyz, ypr.

    Raises:
        ParameterError: the parameter is not such a list.
    """
    if not isinstance(entries, list):
        raise ParameterError(f'a list of frames is expected, not {shown(entries)}')
    groups = [Parameters(entry, f'[{index}]') for index, entry in enumerate(entries)]
    return [Frame(group.frame('parent', ''), group.frame('child', ''),
                  group.vector('xyz', _ZERO), group.vector('ypr', _ZERO)) for group in groups]


def written_frames(frames: Sequence[Frame]) -> List[Dict[str, Any]]:
    """Return the list that ``read_frames`` reads."""
    return [{'parent': frame.parent, 'child': frame.child, 'xyz': list(frame.xyz),
             'ypr': list(frame.ypr)} for frame in frames]
