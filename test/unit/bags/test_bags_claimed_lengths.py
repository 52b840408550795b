# SPDX-License-Identifier: BSD-3-Clause
"""Short messages that claim long arrays: no reader allocates memory for missing data."""
from __future__ import annotations

import struct
import tracemalloc
from typing import Any, Iterator

import pytest
from message_readers import MESSAGES, readers, serialized

_CLAIMED = (0x0fffffff, 0xffffffff)
_MAX_BYTES = 2_000_000
"""Limit for reading one message; each claims at least a gigabyte."""


def _claiming(data: bytes) -> Iterator[bytes]:
    """The message with a false length at each position, complete and truncated there."""
    for place in range(0, len(data) - 3):
        for claimed in _CLAIMED:
            changed = data[:place] + struct.pack('<I', claimed)
            yield changed
            yield changed + data[place + 4:]


@pytest.mark.parametrize('message', MESSAGES, ids=lambda it: it._type)
def test_no_claim_takes_memory(message: Any) -> None:
    data = serialized(message)
    for name, read in readers(message).items():
        tracemalloc.start()
        try:
            for changed in _claiming(data):
                try:
                    read(changed)
                except Exception as error:  # which error is tested with each reader
                    assert not isinstance(error, (MemoryError, RecursionError)), name
            peak_bytes = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert peak_bytes < _MAX_BYTES, name
