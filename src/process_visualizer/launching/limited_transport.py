# SPDX-License-Identifier: BSD-3-Clause
"""Calls over XML-RPC that end, also if nobody answers."""
from __future__ import annotations

from typing import Any
from xmlrpc.client import Transport


class LimitedTransport(Transport):
    """Does not wait for ever."""

    def __init__(self, timeout_s: float) -> None:
        """``timeout_s`` is how long it waits for each part of an answer."""
        super().__init__()
        self._timeout_s = timeout_s

    def make_connection(self, host: Any) -> Any:
        """See Transport."""
        connection = super().make_connection(host)
        connection.timeout = self._timeout_s
        return connection
