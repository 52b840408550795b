# SPDX-License-Identifier: BSD-3-Clause
"""Columns of numbers as one compressed text, which web/src/packed.js decodes."""
from __future__ import annotations

import gzip
from base64 import b64encode
from typing import Dict, List, Union

import numpy as np

Reference = Dict[str, Union[str, int, float, List[float]]]
"""Position, type and encoding of a column."""

_ALIGNMENT = 8
_NS_PER_S = 1e9
_STEPS = {'u2': 65_535, 'u4': 4_294_967_295}
_LARGE = 6.0
"""Extent [m] above which a column gets 32 bits; up to it, 16 bits are accurate to 0.05 mm."""
_SHORT_NS = 2**31 - 1
"""Maximum step between two times [ns] that fits into four bytes."""


class Packed:
    """Collects columns; the page's JSON refers to them."""

    def __init__(self) -> None:
        """Begin without columns."""
        self._data = bytearray()
        self._known: Dict[bytes, Reference] = {}

    def plain(self, values: np.ndarray) -> Reference:
        """Add numbers unchanged, row by row; equal columns are stored once."""
        data = np.ascontiguousarray(values)
        name = data.dtype.newbyteorder('<').str.lstrip('<|=')
        return self._added(data.astype(data.dtype.newbyteorder('<')).tobytes(), name, data.size)

    def single(self, values: np.ndarray) -> Reference:
        """Add numbers in single precision; those that are too large become infinite."""
        with np.errstate(over='ignore'):
            return self.plain(values.astype(np.float32))

    def exact(self, values: np.ndarray) -> Reference:
        """Add numbers in single precision if that is lossless, otherwise in double precision."""
        with np.errstate(over='ignore'):
            short = values.astype(np.float32)
        return self.plain(short if np.array_equal(short, values, equal_nan=True) else values)

    def times(self, times_s: np.ndarray) -> Reference:
        """Add increasing times [s], accurate to 1 ns, so that a step to a message shows it."""
        ns = np.rint(np.asarray(times_s, float) * _NS_PER_S).astype(np.int64)
        begin = int(ns[0]) if len(ns) else 0
        steps = np.diff(ns, prepend=begin)
        is_short = not len(steps) or np.abs(steps).max() <= _SHORT_NS
        return {**self.plain(steps.astype(np.int32 if is_short else np.float64)), 'as': 'times',
                'begin': begin}

    def scaled(self, values: np.ndarray) -> Reference:
        """Add rows of numbers (n, k), each as a fraction of its column's range."""
        known = np.nan_to_num(values, nan=0.0)
        low = known.min(axis=0) if len(known) else np.zeros(values.shape[1])
        size = known.max(axis=0) - low if len(known) else np.zeros(values.shape[1])
        share = np.divide(known - low, size, out=np.zeros_like(known), where=size > 0.0)
        name = 'u2' if not len(size) or size.max() <= _LARGE else 'u4'
        found = self.plain(np.rint(share * _STEPS[name]).astype(f'<{name}'))
        return {**found, 'as': 'scaled', 'low': low.tolist(), 'size': size.tolist()}

    def column(self, reference: Reference, width: int = 1) -> np.ndarray:
        """Return a column, (n,) or (n, width), as web/src/packed.js decodes it."""
        begin, kind = int(reference['at']), np.dtype(f'<{reference["of"]}')  # type: ignore[arg-type]
        end = begin + int(reference['n']) * kind.itemsize  # type: ignore[arg-type]
        values = np.frombuffer(self._data[begin:end], kind)
        if reference.get('as') == 'times':
            return np.asarray((reference['begin'] + np.cumsum(values.astype(np.int64))) / _NS_PER_S)
        if reference.get('as') == 'scaled':
            low, size = np.array(reference['low']), np.array(reference['size'])
            return np.asarray(low + values.reshape(-1, len(low)) / _STEPS[kind.str[1:]] * size)
        return values if width == 1 else values.reshape(-1, width)

    def text(self) -> str:
        """Return all columns as base64 of gzip."""
        return b64encode(gzip.compress(self._data, 7, mtime=0)).decode('ascii')

    def _added(self, data: bytes, name: str, count: int) -> Reference:
        key = name.encode() + data
        if key not in self._known:
            self._known[key] = {'at': len(self._data), 'of': name, 'n': count}
            self._data += data + bytes(-len(data) % _ALIGNMENT)
        return self._known[key]
