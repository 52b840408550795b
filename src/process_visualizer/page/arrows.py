# SPDX-License-Identifier: BSD-3-Clause
"""The arrows of a page: those of the run, and those of its reference."""
from __future__ import annotations

from typing import Any, Dict, List, Optional, Sequence

import numpy as np

from process_visualizer.cell.model import Cell, Device
from process_visualizer.curves.curve_sources import CurveSource
from process_visualizer.motion.ghost_style import (
    BESIDE_M,
    GHOST_ARROW_COLOR,
    GHOST_ARROW_DIAMETER_M,
)
from process_visualizer.motion.variables import VARIABLE_DIAMETER_M
from process_visualizer.page.numbers import color_of
from process_visualizer.page.packed import Packed
from process_visualizer.page.places import Places, Span
from process_visualizer.parameters.configured_arrow import configured_arrow
from process_visualizer.runs.comparison.ghost_arrows import GhostArrow


def arrow_entries(cell: Cell, arrows: Sequence[GhostArrow], begin_s: float,
                  sources: Sequence[CurveSource], places: Places, packed: Packed, span: Span
                  ) -> List[Dict[str, Any]]:
    """Return the arrows of a run, which began at ``begin_s`` of its recording."""
    found = []
    for arrow in arrows:
        device = _device_of(cell, arrow)
        moved = arrow._replace(times_s=arrow.times_s + begin_s)
        entry = None if device is None else _entry(moved, places, packed, span)
        if entry is None or device is None:
            continue
        quantity = arrow.name[len(device.name) + 1:]
        diameter_m = configured_arrow(device, quantity).diameter_m \
            if quantity in ('velocity', 'force') else VARIABLE_DIAMETER_M
        found.append({**entry, 'device': device.name, 'quantity': quantity,
                      'color': list(color_of(device, arrow.name, sources)),
                      'diameter': diameter_m, 'beside': 0.0})
    return found


def ghost_arrow_entries(cell: Cell, arrows: Sequence[GhostArrow], places: Places, packed: Packed,
                        span: Span) -> List[Dict[str, Any]]:
    """Return the arrows of the reference, which are over the time of the recording already."""
    found = []
    for arrow in arrows:
        device, entry = _device_of(cell, arrow), _entry(arrow, places, packed, span)
        if entry is not None and device is not None:
            found.append({**entry, 'device': device.name,
                          'quantity': arrow.name[len(device.name) + 1:],
                          'color': list(GHOST_ARROW_COLOR[:3]),
                          'diameter': GHOST_ARROW_DIAMETER_M, 'beside': BESIDE_M})
    return found


def _entry(arrow: GhostArrow, places: Places, packed: Packed,
           span: Span) -> Optional[Dict[str, Any]]:
    frame, foot_frame = places.number(arrow.frame), places.number(arrow.foot_frame)
    if frame is None or foot_frame is None:
        return None
    rows = span.rows(arrow.times_s)
    return {'frame': frame, 'footFrame': foot_frame, 'foot': list(arrow.foot),
            'times': packed.times(arrow.times_s[rows]),
            'vectors': packed.plain(arrow.vectors[rows].astype(np.float32))}


def _device_of(cell: Cell, arrow: GhostArrow) -> Optional[Device]:
    return next((it for it in cell.devices if arrow.name.startswith(f'{it.name}/')), None)
