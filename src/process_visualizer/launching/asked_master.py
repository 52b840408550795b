# SPDX-License-Identifier: BSD-3-Clause
"""The ROS master, which may hang: no question waits for ever for its answer."""
from __future__ import annotations

from http.client import HTTPException
from typing import Any, List, Optional, Protocol
from xmlrpc.client import Error, ServerProxy

import rosgraph

from process_visualizer.launching.limited_transport import LimitedTransport

ANSWER_TIMEOUT_S = 0.5
"""For those who ask again and again, and have more to do."""
PATIENT_TIMEOUT_S = 3.0
"""For those who ask once."""


class Master(Protocol):
    """The methods of rosgraph.Master of these names, with their results and errors."""

    def getPid(self) -> int:
        """Return the master's process id."""

    def getSystemState(self) -> List[Any]:
        """Return publishers, subscribers and services."""

    def lookupNode(self, node: str) -> str:
        """Return a node's URI."""

    def setParam(self, key: str, value: Any) -> None:
        """Set a parameter."""


class AskedMaster:
    """The master of this process, or another one.

    Each method raises OSError if no master answers in time, and rosgraph.MasterException if it
    answers that there is no such thing.
    """

    def __init__(self, caller: str, uri: Optional[str] = None,
                 timeout_s: float = ANSWER_TIMEOUT_S) -> None:
        """Keep whom to ask; nothing is asked yet.

        Args:
            caller: the name of the node that asks.
            uri: of another master than that of this process.
            timeout_s: for each part of an answer.
        """
        self._caller, self._uri, self._timeout_s = caller, uri, timeout_s

    @property
    def master_uri(self) -> str:
        """Its address."""
        return self._uri or str(rosgraph.get_master_uri())

    def getPid(self) -> int:
        """Return its process id."""
        return int(self._asked('getPid'))

    def getSystemState(self) -> List[Any]:
        """Return publishers, subscribers and services: for each name its nodes."""
        found = self._asked('getSystemState')
        if not isinstance(found, list):
            raise rosgraph.MasterException('the master answers nonsense')
        return found

    def getTopicTypes(self) -> List[Any]:
        """Return the type of each topic."""
        return list(self._asked('getTopicTypes'))

    def lookupNode(self, node: str) -> str:
        """Return a node's URI."""
        return str(self._asked('lookupNode', node))

    def lookupService(self, service: str) -> str:
        """Return the URI of a service, given by its whole name."""
        return str(self._asked('lookupService', service))

    def getParamNames(self) -> List[str]:
        """Return the names of all parameters."""
        return list(self._asked('getParamNames'))

    def hasParam(self, key: str) -> bool:
        """Return whether there is a parameter of this whole name."""
        return bool(self._asked('hasParam', key))

    def getParam(self, key: str) -> Any:
        """Return the value of a parameter, given by its whole name."""
        return self._asked('getParam', key)

    def setParam(self, key: str, value: Any) -> None:
        """Set a parameter, given by its whole name."""
        self._asked('setParam', key, value)

    def _asked(self, method: str, *values: Any) -> Any:
        uri = self.master_uri
        try:
            with ServerProxy(uri, transport=LimitedTransport(self._timeout_s)) as server:
                answer: Any = getattr(server, method)(self._caller, *values)
            code, text, value = answer
        except (HTTPException, Error, ValueError, TypeError) as error:
            raise ConnectionError(f'{uri}: {error}') from error
        if code != 1:
            raise rosgraph.MasterException(text)
        return value
