# SPDX-License-Identifier: BSD-3-Clause
"""Reads the sequence numbers in the headers of many messages at once."""
from __future__ import annotations

import numpy as np

from process_visualizer.bags.record_batches import RecordBatch, record_batches
from process_visualizer.bags.recording import Recording
from process_visualizer.messages.connection import Connection
from process_visualizer.messages.message_definition import (
    HEADER,
    DefinitionError,
    parse_definitions,
    short_name,
)

_HEAD_BYTES = 512
"""Of a record: its header has some 40 bytes, and the number follows."""
_U32 = 4


def header_numbers(recording: Recording) -> np.ndarray:
    """Return the numbers (int64) in the headers of all messages by position, -1 without one."""
    index = recording.index
    numbered = [number for number, it in enumerate(index.connections) if begins_with_header(it)]
    found = np.full(len(index), -1, np.int64)
    for batch in record_batches(recording, index.positions_of(numbered), _HEAD_BYTES):
        found[batch.positions] = _numbers_in(batch)
    return found


def begins_with_header(connection: Connection) -> bool:
    """Return whether the messages begin with a std_msgs/Header."""
    try:
        definitions = parse_definitions(connection.type, connection.message_definition)
    except DefinitionError:
        return False
    fields = definitions.get(short_name(connection.type), [])
    return bool(fields) and fields[0].type_name == HEADER and not fields[0].is_array


def _numbers_in(batch: RecordBatch) -> np.ndarray:
    """The numbers of the records of a batch: header and data follow their lengths."""
    header_size = _u32_at(batch, batch.begin, batch.end)
    data = batch.begin + 2 * _U32 + header_size
    data_size = _u32_at(batch, data - _U32, batch.end)
    number = _u32_at(batch, data, batch.end)
    return np.where((header_size >= 0) & (data_size >= _U32), number, -1)


def _u32_at(batch: RecordBatch, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """The numbers (int64) at some offsets, -1 where the data ends too early."""
    fits = begin + _U32 <= end
    at = np.where(fits, begin, 0)[:, np.newaxis] + np.arange(_U32)
    padded = np.concatenate((batch.buffer, np.zeros(_U32, np.uint8)))
    values = padded[at].view('<u4')[:, 0].astype(np.int64)
    return np.where(fits, values, -1)
