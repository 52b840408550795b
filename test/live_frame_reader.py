# SPDX-License-Identifier: BSD-3-Clause
"""Reads the data of a live page, as web/src/live_tracks.js does."""
from __future__ import annotations

from struct import unpack_from
from typing import Any, Dict, List, NamedTuple, Tuple

import numpy as np


class SeenFrame(NamedTuple):
    """Poses (position, turn) by frame, arrows (foot, vector, color), texts (color, text)."""

    layout: int
    number: int
    time_s: float
    places: Dict[str, Tuple[np.ndarray, np.ndarray]]
    arrows: Dict[Tuple[str, str], Tuple[np.ndarray, np.ndarray, Tuple[int, ...]]]
    texts: Dict[Tuple[str, str], Tuple[Tuple[int, ...], str]]


def read_frame(layout: Dict[str, Any], data: bytes) -> SeenFrame:
    """Decode a frame by its layout; every byte must be used."""
    kind, number, count, time_s = unpack_from('<BxHId', data)
    assert kind == 1
    assert number == layout['number']
    position = 16
    places = {}
    for it in layout['places']:
        if 'at' not in it:
            row = unpack_from('<3f4h', data, position)
            places[it['name']] = np.array(row[:3]), np.array(row[3:]) / 32767
            position += 20
    arrows = {}
    for it in layout['arrows']:
        row = unpack_from('<6f3B', data, position)
        arrows[it['device'], it['quantity']] = np.array(row[:3]), np.array(row[3:6]), row[6:]
        position += 27
    texts = {}
    for it in layout['texts']:
        *color, length = unpack_from('<3BB', data, position)
        position += 4
        text = data[position:position + length].decode()
        texts[it['device'], it['quantity'], it['label']] = tuple(color), text
        position += length
    assert position == len(data)
    return SeenFrame(number, count, time_s, places, arrows, texts)


def frames_behind_lengths(data: bytes) -> List[bytes]:
    """Return the messages of an answer about the past."""
    found, position = [], 0
    while position < len(data):
        length, = unpack_from('<I', data, position)
        found.append(data[position + 4:position + 4 + length])
        position += 4 + length
    return found
