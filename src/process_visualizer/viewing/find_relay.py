# SPDX-License-Identifier: BSD-3-Clause
"""Search for the cell on another computer, and the reasons why it cannot be reached."""
from __future__ import annotations

import socket
import time
from http.client import HTTPException
from typing import Any, List, NamedTuple, Optional, Set, Tuple
from xmlrpc.client import Error, ServerProxy

from process_visualizer.launching.ros_api import CALLER_ID, LimitedTransport
from process_visualizer.remote.link_words import (
    MASTER_PORT,
    NOT_A_MASTER,
    NOT_THE_CELL,
    SAYS_NOTHING,
    Address,
    bracketed,
    is_here,
    is_loopback,
    no_cell,
    nothing_there,
    only_small_packets,
    relay_ended,
    relay_silent,
    unknown_name,
    unreachable,
)
from process_visualizer.remote.offer import ADDRESS_PARAMETER, DEFAULT_PORTS
from process_visualizer.remote.packets import (
    GREETING,
    Kind,
    Packet,
    PacketReader,
    PacketsBroken,
)
from process_visualizer.shown_text import shown_in_line

_ANSWER_S, _WHOLE_S = 4.0, 12.0
_OFFER_S = 8.0
"""Time from the greeting to the offer, which a busy cell makes slowly [s]."""
_ENOUGH_BYTES = 16 << 10
"""Size larger than any network packet [bytes]."""
_MAX_PORT = 65535
_NODE = ADDRESS_PARAMETER.rpartition('/')[0]


class CellNotFound(Exception):
    """There is no cell to watch; ``problems`` has a sentence for each reason."""

    def __init__(self, problems: Tuple[str, ...]) -> None:
        super().__init__('; '.join(problems))
        self.problems = problems


class _MasterAnswer(NamedTuple):
    """A master's answer: the relay's address; None without a relay."""

    relay_address: Optional[str]


def find_relay(wanted: Address) -> Tuple[str, int]:
    """Return host and port of a cell's relay for viewers; takes some seconds at most.

    ``wanted`` is the computer, with the port of the relay or of the ROS master if that is not the
    usual one.

    Raises:
        CellNotFound: no cell can be reached.
    """
    if wanted.port == MASTER_PORT:  # the usual port adds no information
        wanted = Address(wanted.host, None)
    try:
        socket.getaddrinfo(wanted.host, None)
    except (OSError, UnicodeError):
        raise CellNotFound((unknown_name(wanted.host),)) from None
    port_problem = None if wanted.port is None else _problem_at(wanted.host, wanted.port)
    if wanted.port is not None and port_problem is None:
        return wanted.host, wanted.port
    uri = f'http://{bracketed(wanted.host)}:{wanted.port or MASTER_PORT}'
    try:
        answer = _asked(uri)
    except OSError as error:
        if wanted.port is not None:
            certain = port_problem if isinstance(port_problem, _Stated) else error
            raise CellNotFound((unreachable(wanted, certain, 'the cell or its ROS master'),)
                               ) from None
        return _without_master(wanted, error)
    if answer.relay_address is None:
        raise CellNotFound((no_cell(uri),))
    listens, _, last = answer.relay_address.rpartition(':')
    port = int(last)
    is_own = is_loopback(listens) and (is_loopback(wanted.host) or is_here(wanted.host))
    host = listens if is_own else wanted.host
    problem = _problem_at(host, port)
    if is_own and isinstance(problem, ConnectionRefusedError):
        raise CellNotFound((relay_ended(uri, answer.relay_address),))
    if problem is not None:
        raise CellNotFound((unreachable(Address(host, port), problem, 'the cell for viewers')
                            if is_own else relay_silent(host, answer.relay_address, problem),))
    return host, port


def _without_master(wanted: Address, error: OSError) -> Tuple[str, int]:
    """Find a relay at the usual ports: the master may listen only to its own computer."""
    found: List[OSError] = []
    for port in DEFAULT_PORTS:
        problem = _problem_at(wanted.host, port)
        if problem is None:
            return wanted.host, port
        found.append(problem)
        if not isinstance(problem, ConnectionRefusedError):
            break  # the other ports would take as long
    certain = [it for it in found if isinstance(it, _Stated)]
    raise CellNotFound(nothing_there(wanted, error, (*certain, *found)[0]))


def _asked(uri: str) -> _MasterAnswer:
    """Return a master's answer about the relay.

    Raises:
        OSError: nothing answers, or the answer is not that of a ROS master.
    """
    try:
        with ServerProxy(uri, transport=LimitedTransport(_ANSWER_S, _WHOLE_S)) as master:
            answers: List[Any] = [master.getParam(CALLER_ID, ADDRESS_PARAMETER),
                                  master.getSystemState(CALLER_ID)]
    except (HTTPException, Error, ValueError) as error:
        raise ConnectionError(0, f'{NOT_A_MASTER} ({shown_in_line(error)[:80]})') from None
    # The parameter outlives the relay, and so may the node's address, but none of its topics.
    texts = [it[2] if isinstance(it, list) and len(it) == 3 and it[0] == 1 else None
             for it in answers]
    listens = texts[0] if isinstance(texts[0], str) and _NODE in _registered(texts[1]) else ''
    port = listens.rpartition(':')[2]
    return _MasterAnswer(listens if port.isdecimal() and len(port) <= len(str(_MAX_PORT))
                 and int(port) <= _MAX_PORT else None)


def _registered(state: object) -> Set[str]:
    """Return the nodes that have topics or services, in a master's state of whatever form."""
    return {node for kind in _list(state) for topic in _list(kind)
            for nodes in _list(topic)[1:2] for node in _list(nodes) if isinstance(node, str)}


def _list(value: object) -> List[Any]:
    return value if isinstance(value, list) else []


class _Stated(ConnectionError):
    """A problem that the listener at a port reported itself, or showed by its answer."""


def _problem_at(host: str, port: int) -> Optional[OSError]:
    """Return the problem at a port; None if a cell answers and its view begins to arrive."""
    try:
        with socket.create_connection((host, port), _ANSWER_S) as connection:
            connection.sendall(GREETING)
            return _first_answer(connection, host)
    except OSError as error:
        return error


def _first_answer(connection: socket.socket, host: str) -> Optional[OSError]:
    """Wait for more than the greeting, which proves nothing: large packets may still be lost."""
    reader, count, end_s = PacketReader(), 0, time.monotonic() + _WHOLE_S
    while count < _ENOUGH_BYTES:
        try:
            data = connection.recv(_ENOUGH_BYTES)
        except socket.timeout:
            return _Stated(0, only_small_packets(host) if count >= len(GREETING) else SAYS_NOTHING)
        if not data or time.monotonic() > end_s:
            return ConnectionError(0, NOT_THE_CELL)
        count += len(data)
        connection.settimeout(_OFFER_S)
        try:
            packets = reader.take(data)
            if packets:
                return _refusal(packets[0])
        except PacketsBroken:
            return ConnectionError(0, NOT_THE_CELL)
    return None


def _refusal(packet: Packet) -> Optional[OSError]:
    if packet.kind != Kind.REFUSED:
        return None
    return _Stated(0, f'it refuses: {shown_in_line(packet.json().get("reason"))[:300]}')
