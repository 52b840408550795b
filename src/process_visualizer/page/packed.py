# SPDX-License-Identifier: BSD-3-Clause
"""Columns of numbers as one compressed text, which web/src/packed.js takes apart."""
from __future__ import annotations

import gzip
from base64 import b64encode
from typing import Dict, List, Union

import numpy as np

Reference = Dict[str, Union[str, int, float, List[float]]]
"""Where a column is, of what type, and how its numbers are to be read."""

_ALIGNMENT = 8
_US_PER_S = 1e6
_STEPS = 65_535
_MAX_S = 2_000.0
"""Between two times; what is farther away is kept as near as this, which is out of sight."""


class Packed:
    """Takes columns; the references to them go into the page's JSON."""

    def __init__(self) -> None:
        """Begin without columns."""
        self._data = bytearray()
        self._known: Dict[bytes, Reference] = {}

    def plain(self, values: np.ndarray) -> Reference:
        """Add numbers as they are, row by row; what is there already is not added again."""
        data = np.ascontiguousarray(values)
        name = data.dtype.newbyteorder('<').str.lstrip('<|=')
        return self._added(data.astype(data.dtype.newbyteorder('<')).tobytes(), name, data.size)

    def exact(self, values: np.ndarray) -> Reference:
        """Add numbers in single precision where that loses nothing, otherwise in double."""
        with np.errstate(over='ignore'):
            short = values.astype(np.float32)
        return self.plain(short if np.array_equal(short, values, equal_nan=True) else values)

    def times(self, times_s: np.ndarray) -> Reference:
        """Add rising times [s], to the microsecond."""
        us = np.rint(np.asarray(times_s, float) * _US_PER_S).astype(np.int64)
        begin = int(us[0]) if len(us) else 0
        steps = np.diff(us, prepend=begin)
        limit = int(_MAX_S * _US_PER_S)
        return {**self.plain(np.clip(steps, -limit, limit).astype(np.int32)), 'as': 'times',
                'begin': begin}

    def scaled(self, values: np.ndarray) -> Reference:
        """Add rows of numbers (n, k) in 16 bits between the least and the greatest of a column."""
        known = np.nan_to_num(values, nan=0.0)
        low = known.min(axis=0) if len(known) else np.zeros(values.shape[1])
        size = known.max(axis=0) - low if len(known) else np.zeros(values.shape[1])
        share = np.divide(known - low, size, out=np.zeros_like(known), where=size > 0.0)
        found = self.plain(np.rint(share * _STEPS).astype(np.uint16))
        return {**found, 'as': 'scaled', 'low': low.tolist(), 'size': size.tolist()}

    def column(self, reference: Reference, width: int = 1) -> np.ndarray:
        """Return a column, (n,) or (n, width), as web/src/packed.js reads it."""
        begin, kind = int(reference['at']), np.dtype(f'<{reference["of"]}')  # type: ignore[arg-type]
        end = begin + int(reference['n']) * kind.itemsize  # type: ignore[arg-type]
        values = np.frombuffer(self._data[begin:end], kind)
        if reference.get('as') == 'times':
            return np.asarray((reference['begin'] + np.cumsum(values.astype(np.int64))) / _US_PER_S)
        if reference.get('as') == 'scaled':
            low, size = np.array(reference['low']), np.array(reference['size'])
            return np.asarray(low + values.reshape(-1, len(low)) / _STEPS * size)
        return values if width == 1 else values.reshape(-1, width)

    def text(self) -> str:
        """Return all of it: base64 of gzip."""
        return b64encode(gzip.compress(self._data, 7, mtime=0)).decode('ascii')

    def _added(self, data: bytes, name: str, count: int) -> Reference:
        key = name.encode() + data
        if key not in self._known:
            self._known[key] = {'at': len(self._data), 'of': name, 'n': count}
            self._data += data + bytes(-len(data) % _ALIGNMENT)
        return self._known[key]
