# SPDX-License-Identifier: BSD-3-Clause
"""Questions to a ROS master and connections to nodes, with time limits, because both may hang."""
from __future__ import annotations

import socket
import struct
import time
from http.client import HTTPConnection, HTTPException
from typing import Any, Collection, Dict, List, Mapping, Optional, Protocol, Sequence, Tuple, Type
from xml.parsers.expat import ExpatError
from xmlrpc.client import Error, ServerProxy, Transport

import rosgraph
from rosgraph.network import (
    ROSHandshakeException,
    decode_ros_handshake_header,
    write_ros_handshake_header,
)

_WHOLE_FACTOR = 10.0
_MAX_ANSWER_BYTES = 64 << 20
SocketAddress = Tuple[Any, ...]
"""A family, kind, protocol, canonical name and address, as `socket.getaddrinfo` returns them."""


def addresses_of(host: Optional[str], port: Optional[int]) -> List[SocketAddress]:
    """Return the addresses of a TCP port, those of IPv4 first.

    ROS 1 nodes listen at IPv4 addresses, but on many computers "localhost" resolves to ::1 first.

    Raises:
        OSError: the host is not known.
    """
    return sorted(socket.getaddrinfo(host, port, type=socket.SOCK_STREAM),
                  key=lambda it: it[0] != socket.AF_INET)


class _LimitedSocket(socket.socket):
    """Reads answers, each with limits of time and size."""

    part_s = 0.0
    end_s = 0.0
    rest_bytes = 0

    def recv_into(self, *arguments: Any, **values: Any) -> int:
        rest_s = self.end_s - time.monotonic()
        if rest_s <= 0.0:
            raise socket.timeout('timed out')
        self.settimeout(min(self.part_s, rest_s))
        count = super().recv_into(*arguments, **values)
        self.rest_bytes -= count
        if self.rest_bytes < 0:
            raise ConnectionError(0, 'the answer is too long')
        return count


class _LimitedConnection(HTTPConnection):
    """A connection with a limited socket."""

    limited: Optional[_LimitedSocket] = None
    part_s = whole_s = 0.0

    def connect(self) -> None:
        """See HTTPConnection."""
        super().connect()
        self.limited = _LimitedSocket(fileno=self.sock.detach())
        self.limited.settimeout(self.part_s)
        self.sock = self.limited
        self.begin()

    def begin(self) -> None:
        """Begin the time of the next answer."""
        if self.limited is not None:
            self.limited.part_s = self.part_s
            self.limited.end_s = time.monotonic() + self.whole_s
            self.limited.rest_bytes = _MAX_ANSWER_BYTES


class LimitedTransport(Transport):
    """A transport that never waits forever, whatever program answers."""

    def __init__(self, timeout_s: float, whole_s: Optional[float] = None) -> None:
        """``timeout_s`` limits the wait for each part of an answer, ``whole_s`` for the whole."""
        super().__init__()
        self._timeout_s = timeout_s
        self._whole_s = _WHOLE_FACTOR * timeout_s if whole_s is None else whole_s

    def make_connection(self, host: Any) -> Any:
        """See Transport."""
        known = self._connection
        if known[0] == host and isinstance(known[1], _LimitedConnection):
            known[1].begin()
            return known[1]
        address, self._extra_headers, _ = self.get_host_info(host)
        connection = _LimitedConnection(address, timeout=self._timeout_s)
        connection.part_s, connection.whole_s = self._timeout_s, self._whole_s
        self._connection = host, connection
        return connection

    def parse_response(self, response: Any) -> Any:
        """See Transport; an answer that is not XML-RPC is a ConnectionError."""
        try:
            return super().parse_response(response)
        except (ExpatError, LookupError, TypeError, ValueError) as error:
            raise ConnectionError(0, f'the answer is not XML-RPC: {error}') from error


ANSWER_TIMEOUT_S = 0.5
"""Time limit for repeated questions by callers with other tasks."""
PATIENT_TIMEOUT_S = 3.0
"""Time limit for single questions."""


class Master(Protocol):
    """Some methods of rosgraph.Master, with the same names, results and errors."""

    def getPid(self) -> int:
        """Return the master's process id."""

    def getSystemState(self) -> List[Any]:
        """Return publishers, subscribers and services."""

    def lookupNode(self, node: str) -> str:
        """Return a node's URI."""

    def setParam(self, key: str, value: Any) -> None:
        """Set a parameter."""


class MasterUnreachable(ConnectionError):
    """No master answers in time, or the answer is not that of a master."""


class MasterClient:
    """A client of this process's master, or of another one.

    Each method raises MasterUnreachable (an OSError) if no master answers in time, and
    rosgraph.MasterException if the master answers with an error, such as for an unknown name.
    """

    def __init__(self, caller: str, uri: Optional[str] = None,
                 timeout_s: float = ANSWER_TIMEOUT_S) -> None:
        """Prepare the client, without asking yet.

        Args:
            caller: the name of the asking node.
            uri: the address of another master than that of this process.
            timeout_s: time limit for each part of an answer.
        """
        self.caller, self._uri, self._timeout_s = caller, uri, timeout_s

    @property
    def master_uri(self) -> str:
        """The address of the master."""
        return self._uri or str(rosgraph.get_master_uri())

    def getPid(self) -> int:
        """Return the master's process id."""
        return int(self._of(int, 'getPid'))

    def getSystemState(self) -> List[Any]:
        """Return publishers, subscribers and services, each a list of names with their nodes."""
        return list(self._of(list, 'getSystemState'))

    def getTopicTypes(self) -> List[Any]:
        """Return the type of each topic."""
        return list(self._of(list, 'getTopicTypes'))

    def lookupNode(self, node: str) -> str:
        """Return a node's URI."""
        return str(self._asked('lookupNode', node))

    def lookupService(self, service: str) -> str:
        """Return the URI of a service, given by its global name."""
        return str(self._asked('lookupService', service))

    def getParamNames(self) -> List[str]:
        """Return the names of all parameters."""
        return list(self._of(list, 'getParamNames'))

    def hasParam(self, key: str) -> bool:
        """Return whether there is a parameter with this global name."""
        return bool(self._asked('hasParam', key))

    def getParam(self, key: str) -> Any:
        """Return the value of a parameter, given by its global name."""
        return self._asked('getParam', key)

    def setParam(self, key: str, value: Any) -> None:
        """Set a parameter, given by its global name."""
        self._asked('setParam', key, value)

    def unregisterPublisher(self, topic: str, node_uri: str) -> None:
        """Unregister the caller as a publisher of a topic."""
        self._asked('unregisterPublisher', topic, node_uri)

    def unregisterSubscriber(self, topic: str, node_uri: str) -> None:
        """Unregister the caller as a subscriber of a topic."""
        self._asked('unregisterSubscriber', topic, node_uri)

    def unregisterService(self, service: str, service_uri: str) -> None:
        """Unregister the caller's service."""
        self._asked('unregisterService', service, service_uri)

    def _of(self, kind: type, method: str) -> Any:
        """Return the master's answer, which must be of a given type."""
        value = self._asked(method)
        if not isinstance(value, kind):
            raise rosgraph.MasterException('the answer of the master is invalid')
        return value

    def _asked(self, method: str, *values: Any) -> Any:
        uri = self.master_uri
        try:
            with ServerProxy(uri, transport=LimitedTransport(self._timeout_s)) as server:
                answer: Any = getattr(server, method)(self.caller, *values)
            code, text, value = answer
        except OSError as error:
            raise MasterUnreachable(*error.args) from error
        except (HTTPException, Error, ValueError, TypeError) as error:
            raise MasterUnreachable(f'{uri}: {error}') from error
        if code != 1:
            raise rosgraph.MasterException(text)
        return value


# A node's data over our own connection, because rospy knows only one master and waits forever.

_HEADER_BYTES, _LENGTH_BYTES = 65536, 4

CONNECTION_ERRORS = (OSError, ValueError, TypeError, Error, HTTPException,
                     rosgraph.MasterException, ROSHandshakeException)
"""Exceptions that questions to a node and its master may raise."""


def publisher_address(master: 'MasterClient', node: str, topic: str,
                      timeout_s: float) -> Tuple[str, int]:
    """Return host and port at which a node publishes a topic.

    Raises:
        CONNECTION_ERRORS: the node does not publish the topic, or does not answer.
    """
    return _publisher_at(master.lookupNode(node), master.caller, topic, timeout_s)


def connected_publisher(own_uri: str, caller: str, topic: str, timeout_s: float) -> Tuple[str, int]:
    """Return host and port of a topic's publisher, as known to a subscriber; no master is asked.

    Args:
        own_uri: the URI of the subscribed node.
        caller: the name of the asking node.
        topic: the global name.
        timeout_s: time limit for each part of an answer.

    Raises:
        CONNECTION_ERRORS: no node publishes the topic, or the publisher does not answer.
    """
    with ServerProxy(own_uri, transport=LimitedTransport(timeout_s)) as own:
        answer: Any = own.getBusInfo(caller)
    for _, uri, direction, _, name, *_ in answer[2]:
        if (direction, name) == ('i', topic):
            return _publisher_at(uri, caller, topic, timeout_s)
    raise ValueError(f'no publisher of {topic} is known')


def _publisher_at(uri: str, caller: str, topic: str, timeout_s: float) -> Tuple[str, int]:
    with ServerProxy(uri, transport=LimitedTransport(timeout_s)) as api:
        answer: Any = api.requestTopic(caller, topic, [['TCPROS']])
    _, reason, protocol = answer
    if not protocol:
        raise ValueError(f'the node does not publish {topic} ({reason})')
    _, host, port = protocol
    return str(host), int(port)


def connected_by_handshake(address: Tuple[Optional[str], int], header: Mapping[str, str],
                           timeout_s: float) -> Tuple[socket.socket, Dict[str, str]]:
    """Return a connection to a node, and the node's answer to our header (TCPROS).

    Raises:
        OSError, ROSHandshakeException: nothing answers, or the header is refused.
    """
    connection = socket.create_connection(address, timeout_s)
    try:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        write_ros_handshake_header(connection, dict(header))
        answer = _handshake_header(connection)
        if 'error' in answer:
            raise ROSHandshakeException(answer['error'])
    except BaseException:
        connection.close()
        raise
    return connection, answer


def _handshake_header(connection: socket.socket) -> Dict[str, str]:
    """Read the header of a node, and nothing after it: the first message may follow at once."""
    head = received(connection, _LENGTH_BYTES, ROSHandshakeException)
    size = int.from_bytes(head, 'little')
    if size > _HEADER_BYTES:
        raise ROSHandshakeException(f'a header of {size} bytes is too large')
    try:
        header: Dict[str, str] = decode_ros_handshake_header(
            head + received(connection, size, ROSHandshakeException))
    except struct.error as error:
        raise ROSHandshakeException(f'the header is damaged: {error}') from None
    return header


def received(connection: socket.socket, size: int, closed: Type[Exception]) -> bytes:
    """Return exactly ``size`` bytes; if the node closes the connection, raise ``closed``."""
    data = b''
    while len(data) < size:
        part = connection.recv(size - len(data))
        if not part:
            raise closed('the node has closed the connection')
        data += part
    return data


# Direct questions to a ROS master or node, by its address.

CALLER_ID = '/process_visualizer_watcher'


def process_id_at(uri: str) -> int:
    """Return the process id of the master or node at an address.

    Raises:
        OSError, HTTPException, xmlrpc.client.Error: nothing answers within 3 s, or another
            program does.
        ValueError: the answer is not that of a master or node.
    """
    with ServerProxy(uri, transport=LimitedTransport(PATIENT_TIMEOUT_S)) as server:
        answer: Any = server.getPid(CALLER_ID)
    if (not isinstance(answer, list) or len(answer) != 3 or answer[0] != 1
            or not isinstance(answer[2], int)):
        raise ValueError(f'{uri} is not a ROS master or node')
    return int(answer[2])


def is_registered(name: str, master_uri: Optional[str] = None) -> bool:
    """Return whether the master knows a node and the node answers; False without a master.

    The master still knows a node that has ended without unregistering, or that has cached a
    parameter. ``master_uri`` is set for another master than the usual one.
    """
    try:
        process_id_at(MasterClient(CALLER_ID, master_uri, PATIENT_TIMEOUT_S).lookupNode(name))
    except (rosgraph.MasterException, OSError, HTTPException, Error, ValueError):
        return False
    return True


def forget_ended(names: Collection[str], master_uri: Optional[str] = None) -> List[str]:
    """Unregister nodes whose processes have ended without doing so; return their names.

    According to the master, a killed node still publishes and offers its services. This does the
    same as ``rosnode cleanup``, but only for these nodes. A node whose address does not refuse the
    connection is left alone: the node, or its network, may only be slow.
    """
    forgotten = []
    try:
        state = MasterClient(CALLER_ID, master_uri, PATIENT_TIMEOUT_S).getSystemState()
        known = {node for kind in state for _, nodes in kind for node in nodes}
        for name in names:
            if name in known and _is_gone(name, master_uri):
                _forget(name, state, master_uri)
                forgotten.append(name)
    except (OSError, rosgraph.MasterException, TypeError, ValueError):
        pass  # the master has ended, or is not a master
    return forgotten


def _is_gone(name: str, master_uri: Optional[str]) -> bool:
    """Return whether nothing listens at a node's address."""
    try:
        process_id_at(MasterClient(CALLER_ID, master_uri, PATIENT_TIMEOUT_S).lookupNode(name))
    except ConnectionRefusedError:
        return True
    except (rosgraph.MasterException, OSError, HTTPException, Error, ValueError):
        pass
    return False


def _forget(name: str, state: Sequence[Any], master_uri: Optional[str]) -> None:
    """Unregister everything that the master's state lists for a node."""
    master = MasterClient(name, master_uri, PATIENT_TIMEOUT_S)
    uri = master.lookupNode(name)
    publishers, subscribers, services = (
        [what for what, nodes in kind if name in nodes] for kind in state)
    for topic in subscribers:
        master.unregisterSubscriber(topic, uri)
    for topic in publishers:
        master.unregisterPublisher(topic, uri)
    for service in services:
        master.unregisterService(service, master.lookupService(service))
