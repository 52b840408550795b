# SPDX-License-Identifier: BSD-3-Clause
"""The parameter ~frames of the node cell_frames."""
from __future__ import annotations

from typing import Any, Dict, List, Sequence

from process_visualizer.motion.frame_tree import Frame
from process_visualizer.parameters.reading import ParameterError, Parameters

_ZERO = (0.0, 0.0, 0.0)


def read_frames(entries: Any) -> List[Frame]:
    """Return the frames of a parameter: a list of dictionaries parent, child, xyz, ypr.

    Raises:
        ParameterError: the parameter is not such a list.
    """
    if not isinstance(entries, list):
        raise ParameterError(f'a list of frames is expected, not {entries!r}')
    groups = [Parameters(entry, f'[{index}]') for index, entry in enumerate(entries)]
    return [Frame(group.frame('parent', ''), group.frame('child', ''),
                  group.vector('xyz', _ZERO), group.vector('ypr', _ZERO)) for group in groups]


def written_frames(frames: Sequence[Frame]) -> List[Dict[str, Any]]:
    """Return the list that ``read_frames`` reads."""
    return [{'parent': frame.parent, 'child': frame.child, 'xyz': list(frame.xyz),
             'ypr': list(frame.ypr)} for frame in frames]
