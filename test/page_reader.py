# SPDX-License-Identifier: BSD-3-Clause
"""Reads a page of ``cell share`` as web/src does: values at a time, and interpolated ones."""
from __future__ import annotations

import gzip
import json
import re
from base64 import b64decode
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

_ELEMENT = r'<script type="[a-z/]+" id="{}">(.*?)</script>'
_TURN_STEPS = 32_767


class PageReader:
    """The data of a page."""

    def __init__(self, html: str) -> None:
        def element(name: str) -> str:
            found = re.search(_ELEMENT.format(name), html, re.DOTALL)
            assert found is not None, name
            return found.group(1)
        self.data: Dict[str, Any] = json.loads(element('data'))
        self._bytes = gzip.decompress(b64decode(element('columns')))

    def column(self, reference: Dict[str, Any], width: int = 1) -> np.ndarray:
        values = np.frombuffer(self._bytes, f'<{reference["of"]}', reference['n'],
                               reference['at'])
        if reference.get('as') == 'times':
            return (reference['begin'] + np.cumsum(values.astype(np.int64))) / 1e9
        if reference.get('as') == 'scaled':
            rows = values.reshape(-1, len(reference['low'])) / np.iinfo(values.dtype).max
            return np.array(reference['low']) + rows * np.array(reference['size'])
        return values if width == 1 else values.reshape(-1, width)

    def number(self, run: int, device: str, quantity: str,
               label: str = '') -> Dict[str, Any]:
        return next(it for it in self.data['runs'][run]['numbers'] if it['device'] == device
                    and it['quantity'] == quantity and label in ('', it['label']))

    def value(self, entry: Dict[str, Any], time_s: float) -> Optional[float]:
        times_s = self.column(entry['times'])
        if 'vectors' in entry:
            vector = between(times_s, self.column(entry['vectors'], 3), time_s)
            return None if vector is None else float(np.linalg.norm(vector))
        row = int(np.searchsorted(times_s, time_s, 'right')) - 1
        return None if row < 0 else float(self.column(entry['values'])[row])

    def text(self, entry: Dict[str, Any], time_s: float) -> str:
        row = int(np.searchsorted(self.column(entry['times']), time_s, 'right')) - 1
        return str(entry['texts'][self.column(entry['text'])[row]])

    def place(self, run: int, number: int, time_s: float) -> Tuple[np.ndarray, np.ndarray]:
        """Return position [m] and quaternion."""
        entry = self.data['runs'][run]['places'][number]
        if 'at' in entry:
            return np.array(entry['at'][:3]), np.array(entry['at'][3:])
        times_s = self.column(entry['times'])
        rows = np.hstack((self.column(entry['positions']),
                          self.column(entry['turns'], 4) / _TURN_STEPS))
        if entry.get('between'):
            found = np.array([np.interp(time_s, times_s, column) for column in rows.T])
        else:
            found = rows[max(int(np.searchsorted(times_s, time_s, 'right')) - 1, 0)]
        return found[:3], found[3:] / np.linalg.norm(found[3:])

    def links(self, run: int) -> List[Tuple[str, str, int]]:
        """Return device, link and number of its pose."""
        return [(it['device'], it['link'], it['place'])
                for it in self.data['runs'][run]['parts']]


def between(times_s: np.ndarray, rows: np.ndarray, time_s: float) -> Optional[np.ndarray]:
    row = int(np.searchsorted(times_s, time_s, 'right')) - 1
    if row < 0 or row == len(times_s) - 1 and time_s > times_s[row]:
        return None
    behind = min(row + 1, len(times_s) - 1)
    span_s = times_s[behind] - times_s[row]
    share = (time_s - times_s[row]) / span_s if span_s > 0.0 else 0.0
    found = rows[row] + share * (rows[behind] - rows[row]) if share else rows[row]
    return found if np.isfinite(found).all() else None
