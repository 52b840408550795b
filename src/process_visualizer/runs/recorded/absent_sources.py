# SPDX-License-Identifier: BSD-3-Clause
"""Sources that the configuration names and a recording does not have."""
from __future__ import annotations

from typing import NamedTuple, Optional, Sequence, Set, Tuple

from process_visualizer.bags.bag_errors import BagDamaged
from process_visualizer.bags.recording import Recording
from process_visualizer.cell.suggestions import nearest
from process_visualizer.curves.curve_sources import CurveSource, Quantity
from process_visualizer.curves.samples import Series


class Absent(NamedTuple):
    """A source without data: what is wrong, and the name that may be meant; empty if none is.

    Of a topic whose messages have no such field, the text says so.
    """

    name: str
    text: str
    is_misspelt: bool


def absent_sources(recording: Recording, wanted: Sequence[CurveSource],
                   series: Sequence[Series]) -> Tuple[Absent, ...]:
    """Return which of the wanted sources of numbers a recording does not have, given its series."""
    topics = {it.topic for it in recording.index.connections}
    found = [it.source for it in series if _has_field(recording, it)]
    return tuple(_absent(source, topics) for source in wanted
                 if source not in found and not source.plain)


def _has_field(recording: Recording, series: Series) -> bool:
    """Return whether the first messages have the number; without any, nothing is known."""
    if series.source.quantity is not Quantity.NUMBER:
        return True
    for number, locator in series.locators.parts[0].items():
        positions = recording.index.positions(number)
        try:
            if not len(positions) or locator.places(recording.message(int(positions[0]))).numbers:
                return True
        except BagDamaged:
            return True
    return False


def _absent(source: CurveSource, topics: Set[str]) -> Absent:
    name = f'{source.device} {source.channel_label}'.strip()
    if source.topic in topics:
        what = f'number "{source.field}"' if source.quantity is Quantity.NUMBER \
            else f'{source.channel_label} that can be read'
        return Absent(name, f'the messages of "{source.topic}" have no {what}, which is configured '
                            f'for "{name}"', source.quantity is Quantity.NUMBER)
    meant: Optional[str] = nearest(source.topic, topics)
    hint = '' if meant is None else f'; did you mean "{meant}"?'
    return Absent(name, f'no recording has the topic "{source.topic}", which is configured for '
                        f'"{name}"{hint}', meant is not None)
