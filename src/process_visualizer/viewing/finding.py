# SPDX-License-Identifier: BSD-3-Clause
"""Finds the cell on another computer, and says what is in the way."""
from __future__ import annotations

import socket
from http.client import HTTPException
from typing import Any, List, NamedTuple, Optional, Tuple
from xmlrpc.client import Error, ServerProxy

from process_visualizer.launching.ros_api import CALLER_ID, LimitedTransport
from process_visualizer.remote.frames import GREETING
from process_visualizer.remote.link_words import (
    MASTER_PORT,
    Address,
    no_cell,
    nothing_there,
    relay_silent,
    unknown_name,
    unreachable,
)
from process_visualizer.remote.offer import ADDRESS_PARAMETER, DEFAULT_PORTS

_ANSWER_S = 4.0
_NODE = ADDRESS_PARAMETER.rpartition('/')[0]


class CellNotFound(Exception):
    """There is no cell to be watched; ``problems`` has a sentence for each thing that is wrong."""

    def __init__(self, problems: Tuple[str, ...]) -> None:
        super().__init__('; '.join(problems))
        self.problems = problems


class _Said(NamedTuple):
    """A master's answer: where the relay listens, None if it knows none."""

    listens: Optional[str]


def find_relay(wanted: Address) -> Tuple[str, int]:
    """Return host and port at which a cell lets others watch; takes some seconds at most.

    ``wanted`` is the computer, with the port of the cell itself or of its ROS master, if either is
    not the usual one.

    Raises:
        CellNotFound: there is none that can be reached.
    """
    if wanted.port == MASTER_PORT:  # the usual one says no more than none
        wanted = Address(wanted.host, None)
    try:
        socket.getaddrinfo(wanted.host, None)
    except (OSError, UnicodeError):
        raise CellNotFound((unknown_name(wanted.host),)) from None
    if wanted.port is not None and _greets(wanted.host, wanted.port) is None:
        return wanted.host, wanted.port
    uri = f'http://{_in_uri(wanted.host)}:{wanted.port or MASTER_PORT}'
    try:
        said = _asked(uri)
    except OSError as error:
        return _without_master(wanted, error)
    if said.listens is None:
        raise CellNotFound((no_cell(uri),))
    port = int(said.listens.rpartition(':')[2])
    problem = _greets(wanted.host, port)
    if problem is not None:
        raise CellNotFound((relay_silent(wanted.host, said.listens, problem),))
    return wanted.host, port


def _without_master(wanted: Address, error: OSError) -> Tuple[str, int]:
    """The master of a cell may listen to its own computer only, while the cell does not."""
    if wanted.port is not None:
        raise CellNotFound((unreachable(wanted, error, 'the cell or its ROS master'),))
    first: Optional[OSError] = None
    for port in DEFAULT_PORTS:
        problem = _greets(wanted.host, port)
        if problem is None:
            return wanted.host, port
        first = first or problem
        if not isinstance(problem, ConnectionRefusedError):
            break  # nobody answers at all: the other ports would take as long
    raise CellNotFound(nothing_there(wanted, error, first or error))


def _asked(uri: str) -> _Said:
    """Ask a master for the relay.

    Raises:
        OSError: it does not answer, or is no relay.
    """
    try:
        with ServerProxy(uri, transport=LimitedTransport(_ANSWER_S)) as master:
            answers: List[Any] = [master.getParam(CALLER_ID, ADDRESS_PARAMETER),
                                  master.lookupNode(CALLER_ID, _NODE)]
    except (HTTPException, Error, ValueError) as error:
        raise ConnectionError(0, f'what answers is no ROS master ({error})') from None
    texts = [it[2] if isinstance(it, list) and len(it) == 3 and it[0] == 1 else None
             for it in answers]
    listens = texts[0] if isinstance(texts[0], str) and texts[1] else ''
    return _Said(listens if listens.rpartition(':')[2].isdecimal() else None)


def _greets(host: str, port: int) -> Optional[OSError]:
    """Return what is wrong; None if a relay answers there."""
    try:
        with socket.create_connection((host, port), _ANSWER_S) as connection:
            connection.sendall(GREETING)
            received = b''
            while len(received) < len(GREETING):
                data = connection.recv(len(GREETING) - len(received))
                if not data:
                    break
                received += data
    except OSError as error:
        return error
    if received == GREETING:
        return None
    return ConnectionError(0, 'what answers there is not the cell of this program, or one of '
                              'another version')


def _in_uri(host: str) -> str:
    return f'[{host}]' if ':' in host else host
