# SPDX-License-Identifier: BSD-3-Clause
"""Styles of a robot's arrows: as the configuration says, otherwise the defaults."""
from __future__ import annotations

from dataclasses import replace
from typing import Any, Dict

from process_visualizer.cell.model import Arrow, Device
from process_visualizer.parameters.arrow_style import FORCE_ARROW, VELOCITY_ARROW, ArrowStyle
from process_visualizer.parameters.reading import opaque

_DEFAULTS = {'velocity': VELOCITY_ARROW, 'force': FORCE_ARROW}


def configured_arrow(device: Device, quantity: str) -> ArrowStyle:
    """Return the style of a robot's arrow of a quantity, 'velocity' or 'force'."""
    default = _DEFAULTS[quantity]
    return next((_changed(default, arrow) for arrow in device.arrows
                 if arrow.quantity == quantity), default)


def _changed(style: ArrowStyle, arrow: Arrow) -> ArrowStyle:
    given: Dict[str, Any] = {
        'scale_m': arrow.scale, 'min_m': arrow.minimum_m, 'max_m': arrow.maximum_m,
        'color': None if arrow.color is None else opaque(arrow.color)}
    return replace(style, **{name: value for name, value in given.items() if value is not None})
