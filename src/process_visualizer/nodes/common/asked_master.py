# SPDX-License-Identifier: BSD-3-Clause
"""The ROS master, which may hang: no question waits for ever for its answer."""
from __future__ import annotations

from http.client import HTTPException
from typing import Any, List, Protocol
from xmlrpc.client import Error, ServerProxy

import rosgraph

from process_visualizer.launching.ros_api import LimitedTransport

ANSWER_TIMEOUT_S = 0.5


class Master(Protocol):
    """What the methods of rosgraph.Master of these names return and raise."""

    def getSystemState(self) -> List[Any]:
        """Return publishers, subscribers and services."""

    def lookupNode(self, node: str) -> str:
        """Return a node's URI."""

    def setParam(self, key: str, value: Any) -> None:
        """Set a parameter."""


class AskedMaster:
    """The master of this process."""

    def __init__(self, caller: str) -> None:
        """``caller`` is the name of the node that asks."""
        self._caller = caller

    def getSystemState(self) -> List[Any]:
        """Return publishers, subscribers and services.

        Raises:
            rosgraph.MasterException: the answer is none.
            OSError: the master does not answer within half a second.
        """
        found = self._asked('getSystemState')
        if not isinstance(found, list):
            raise rosgraph.MasterException('the master answers nonsense')
        return found

    def lookupNode(self, node: str) -> str:
        """Return a node's URI.

        Raises:
            rosgraph.MasterException: the master does not know it.
            OSError: the master does not answer within half a second.
        """
        return str(self._asked('lookupNode', node))

    def setParam(self, key: str, value: Any) -> None:
        """Set a parameter, given by its whole name.

        Raises:
            rosgraph.MasterException: it is refused.
            OSError: the master does not answer within half a second.
        """
        self._asked('setParam', key, value)

    def _asked(self, method: str, *values: Any) -> Any:
        uri = rosgraph.get_master_uri()
        try:
            with ServerProxy(uri, transport=LimitedTransport(ANSWER_TIMEOUT_S)) as server:
                answer: Any = getattr(server, method)(self._caller, *values)
            code, text, value = answer
        except (HTTPException, Error, ValueError, TypeError) as error:
            raise ConnectionError(f'{uri}: {error}') from error
        if code != 1:
            raise rosgraph.MasterException(text)
        return value
