# SPDX-License-Identifier: BSD-3-Clause
"""Markers that would let RViz ask another computer for a mesh."""
from __future__ import annotations

import re
from typing import Optional

from process_visualizer.messages.connection import Connection
from process_visualizer.messages.marker_removal import has_markers
from process_visualizer.messages.message_layout import Data

_PACKAGE = 'visualization_msgs/'
_FETCHED = re.compile(rb'(?![Pp]ackage:|[Ff]ile:)[A-Za-z][A-Za-z0-9+.-]{1,15}://[^\x00-\x20]+')
_LENGTH_BYTES = 4


def fetched_mesh(connection: Connection, data: Data) -> Optional[str]:
    """Return the address of a mesh that RViz would fetch for a message of markers, or None.

    It is a text of its own in the message: what is only mentioned in a label is none.
    """
    if not (connection.type.startswith(_PACKAGE) or has_markers(connection)):
        return None
    for found in _FETCHED.finditer(data):
        begin = found.start()
        length = int.from_bytes(data[max(begin - _LENGTH_BYTES, 0):begin], 'little')
        if 0 < length <= len(found.group()):
            return found.group()[:length].decode('utf-8', 'replace')
    return None
