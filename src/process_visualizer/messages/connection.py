# SPDX-License-Identifier: BSD-3-Clause
"""What a publisher says of a topic when it connects."""
from __future__ import annotations

from typing import NamedTuple


class Connection(NamedTuple):
    """What a publisher said about a topic; ``type`` is `package/Type`, as in the bag."""

    topic: str
    type: str
    md5sum: str
    message_definition: str
    latching: bool
    caller_id: str
