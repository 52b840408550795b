# SPDX-License-Identifier: BSD-3-Clause
"""The numbers of a recording over time, with the texts that RViz shows beside its arrows."""
from __future__ import annotations

import math
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bagio.bag_errors import BagDamaged
from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Cell, Color, Device, Variable
from process_visualizer.curves.curve_sources import CurveSource, Quantity
from process_visualizer.curves.samples import Samples, Series, sampled
from process_visualizer.health.staleness import STALE_AFTER_S, value_holds_for_s
from process_visualizer.page.packed import Packed
from process_visualizer.page.robots import FramePlaces, PageSpan
from process_visualizer.parameters.variable_colors import colors_of
from process_visualizer.playback.playback_event import MOMENT_NS
from process_visualizer.robot.arrows import (
    BESIDE_M,
    GHOST_ARROW_COLOR,
    GHOST_ARROW_DIAMETER_M,
    VARIABLE_DIAMETER_M,
    configured_arrow,
    format_value,
    variable_text,
)
from process_visualizer.robot.recorded_velocity import velocity_rows
from process_visualizer.runs.comparison.ghost import ReferenceArrow

_MOMENT_S = MOMENT_NS / 1e9


class SourceSamples(NamedTuple):
    """Samples of a source; ``is_whole``: its type has whole numbers only."""

    samples: Samples
    is_whole: bool


def is_whole(recording: Recording, series: Series) -> bool:
    """Return whether the number in the first message of a source has an integer type."""
    for number, locator in series.locators.parts[0].items():
        for position in recording.index.positions(number)[:1].tolist():
            try:
                places = locator.places(recording.message(position))
            except BagDamaged:
                continue
            if places.numbers:
                return np.dtype(places.numbers[0].kind).kind in 'iub'
    return False


def number_entry(device: Device, found: SourceSamples, packed: Packed, span: PageSpan
                 ) -> Dict[str, Any]:
    """Return a source's numbers as an entry of the page."""
    source = found.samples.source
    entry: Dict[str, Any] = {
        'device': source.device, 'label': source.channel_label, 'unit': source.unit,
        'topic': source.topic, 'color': list(source.color), 'quantity': source.quantity.value}
    if source.quantity is Quantity.SPEED:
        return {**entry, **_speed(device, found.samples, packed, span)}
    times_s, values = held(found.samples)
    holds_s = value_holds_for_s(np.diff(times_s).tolist(), STALE_AFTER_S)
    rows = span.rows(times_s)
    times_s, values = times_s[rows], values[rows]
    texts, numbers = _texts(device, source, found, values)
    return {**entry, 'times': packed.times(times_s), 'values': packed.exact(values),
            'texts': texts, 'text': packed.plain(numbers),
            'short': configured_arrow(device, 'force').label
            if source.quantity is Quantity.FORCE else source.label,
            'holds': holds_s if math.isfinite(holds_s) else None,
            **_colors(device, source, values, packed)}


def held(samples: Samples) -> Tuple[np.ndarray, np.ndarray]:
    """Return times [s] (n,) and the values (n,) that hold from then on, as in PositionValues.

    A first value shortly after the start holds from the start on. The value of a joint in an array
    is the last number read.
    """
    times_s = samples.times_s.copy()
    with np.errstate(over='ignore', invalid='ignore'):
        values = samples.values[:, -1] if samples.source.quantity is Quantity.JOINT \
            else sampled(samples)[1]
    order = np.argsort(times_s, kind='stable')
    times_s, values = times_s[order], values[order]
    if len(times_s) and times_s[0] <= _MOMENT_S:
        times_s[0] = 0.0
    return times_s, values


def _speed(device: Device, samples: Samples, packed: Packed, span: PageSpan) -> Dict[str, Any]:
    times_s, slopes = velocity_rows(samples.times_s, samples.values)
    rows = span.rows(times_s)
    style = configured_arrow(device, 'velocity')
    return {'times': packed.times(times_s[rows]),
            'vectors': packed.plain(slopes[rows].astype(np.float32)),
            'format': {'label': style.label, 'unit': style.unit, 'decimals': style.decimals}}


def _texts(device: Device, source: CurveSource, found: SourceSamples,
           values: np.ndarray) -> Tuple[List[str], np.ndarray]:
    """Return the distinct texts of all values, and the index (n,) of each value's text."""
    written = _writer(device, source, found.is_whole)
    unique, number = np.unique(values, return_inverse=True)
    texts = [written(value) for value in unique.tolist()]
    distinct = {text: row for row, text in enumerate(dict.fromkeys(texts))}
    rows = np.array([distinct[text] for text in texts], np.int64)[number.reshape(-1)]
    return list(distinct), rows.astype(np.uint16 if len(distinct) < 65_536 else np.uint32)


def _writer(device: Device, source: CurveSource, whole: bool) -> Callable[[float], str]:
    if source.quantity is Quantity.FORCE:
        style = configured_arrow(device, 'force')
        return lambda value: format_value(style.label, value, style.unit, style.decimals)
    variable = variable_of(device, source)
    offset, scale_m = (0.0, 0.0) if variable is None else (variable.offset, variable.scale)
    names = dict(source.value_names)

    def written(value: float) -> str:
        text = variable_text(source.label, int(value) if whole else value, source.unit, offset,
                             scale_m)
        return f'{text} ({names[value]})' if value in names else text
    return written


def variable_of(device: Device, source: CurveSource) -> 'Variable | None':
    """Return the configured variable of a number; None for a plain topic or a robot's number."""
    return next((it for it in device.variables if it.topic == source.topic
                 and it.field == source.field
                 and (it.label or it.topic.strip('/')) == source.label), None)


def _colors(device: Device, source: CurveSource, values: np.ndarray,
            packed: Packed) -> Dict[str, Any]:
    """Return the distinct colors of a variable colored by its value, and each value's color."""
    variable = variable_of(device, source)
    if variable is None or variable.limits is None and variable.color_scale is None:
        return {}
    colors = colors_of(variable)
    found = [tuple(round(part, 3) for part in colors.of(value)[:3]) for value in values.tolist()]
    distinct: Dict[Tuple[float, ...], int] = {
        color: row for row, color in enumerate(dict.fromkeys(found))}
    return {'colors': [list(it) for it in distinct],
            'colored': packed.plain(np.array([distinct[it] for it in found], np.uint16))}


def color_of(device: Device, label: str, sources: Sequence[CurveSource]) -> Color:
    """Return the color of a variable's arrow."""
    return next((it.color for it in sources
                 if it.device == device.name and it.label == label), (0.5, 0.5, 0.5))


def arrow_entries(
    cell: Cell,
    arrows: Sequence[ReferenceArrow],
    sources: Sequence[CurveSource],
    places: FramePlaces,
    packed: Packed,
    span: PageSpan,
) -> List[Dict[str, Any]]:
    """Return the arrows of a recording; velocities are interpolated, other arrows hold."""
    found = []
    for arrow in arrows:
        device = _device_of(cell, arrow)
        entry = None if device is None else _entry(arrow, places, packed, span)
        if entry is None or device is None:
            continue
        quantity = arrow.name[len(device.name) + 1:]
        if arrow.is_variable:
            drawn = {'color': list(color_of(device, quantity, sources)),
                     'diameter': VARIABLE_DIAMETER_M}
        else:
            style = configured_arrow(device, quantity)
            drawn = {'color': list(style.color[:3]), 'diameter': style.diameter_m,
                     **({'between': True} if quantity == 'velocity' else {})}
        found.append({**entry, **drawn, 'device': device.name, 'quantity': quantity,
                      'variable': arrow.is_variable, 'beside': 0.0})
    return found


def ghost_arrow_entries(
    cell: Cell,
    arrows: Sequence[ReferenceArrow],
    places: FramePlaces,
    packed: Packed,
    span: PageSpan,
) -> List[Dict[str, Any]]:
    """Return the arrows of the reference run, already on the time base of the recording."""
    found = []
    for arrow in arrows:
        device, entry = _device_of(cell, arrow), _entry(arrow, places, packed, span)
        if entry is not None and device is not None:
            found.append({**entry, 'between': True, 'device': device.name,
                          'quantity': arrow.name[len(device.name) + 1:],
                          'variable': arrow.is_variable,
                          'color': list(GHOST_ARROW_COLOR[:3]),
                          'diameter': GHOST_ARROW_DIAMETER_M, 'beside': BESIDE_M})
    return found


def _entry(arrow: ReferenceArrow, places: FramePlaces, packed: Packed,
           span: PageSpan) -> Optional[Dict[str, Any]]:
    frame, foot_frame = places.number(arrow.frame), places.number(arrow.foot_frame)
    if frame is None or foot_frame is None:
        return None
    rows = span.rows(arrow.times_s)
    return {'frame': frame, 'footFrame': foot_frame, 'foot': list(arrow.foot),
            'times': packed.times(arrow.times_s[rows]),
            'vectors': packed.plain(arrow.vectors[rows].astype(np.float32))}


def _device_of(cell: Cell, arrow: ReferenceArrow) -> Optional[Device]:
    return next((it for it in cell.devices if arrow.name.startswith(f'{it.name}/')), None)
