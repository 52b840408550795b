# SPDX-License-Identifier: BSD-3-Clause
"""A publisher's statement on a topic when it connects."""
from __future__ import annotations

from typing import NamedTuple


class Connection(NamedTuple):
    """A publisher's statement on a topic; ``type`` is `package/Type`, as in the bag."""

    topic: str
    type: str
    md5sum: str
    message_definition: str
    latching: bool
    caller_id: str
