# SPDX-License-Identifier: BSD-3-Clause
"""Persistent connections to services, which detect a node that hangs or has restarted."""
from __future__ import annotations

import io
import select
import socket
import struct
import threading
import time
from typing import Any, Callable, ClassVar, Generic, Mapping, Optional, Tuple, Type, TypeVar
from urllib.parse import urlsplit

import genpy
import rosgraph
import rospy

from process_visualizer.launching.ros_api import (
    CONNECTION_ERRORS,
    PATIENT_TIMEOUT_S,
    MasterClient,
    connected_by_handshake,
    connected_publisher,
    received,
)

_RETRY_S = 0.1
_HEAD = struct.Struct('<BI')  # of an answer: success, and the length of the rest
_LENGTH = struct.Struct('<I')


class ServiceUnreachable(Exception):
    """The service does not answer; the text gives the reason."""


class ServiceMissing(ServiceUnreachable):
    """No node offers the service."""


class _Gone(Exception):
    """The node has closed the connection, so it no longer runs."""


class ServiceConnection:
    """Calls one service repeatedly over one connection. May be used by several threads.

    rospy's own proxy either asks the master for the address at each call, or waits forever for a
    node that hangs and fails once after each restart.
    """

    def __init__(self, name: str, service: Type[Any], timeout_s: float = 10.0,
                 master_uri: Optional[str] = None,
                 address: Optional[Callable[[], Tuple[str, int]]] = None) -> None:
        """``name`` is global, ``service`` a generated class; ``timeout_s`` limits each answer.

        ``master_uri`` is set for another master than that of this process. ``address`` returns
        the node's host and port if the master does not; it raises CONNECTION_ERRORS.
        """
        self._name, self._master_uri = name, master_uri
        self._service = service
        self._timeout_s, self._address = timeout_s, address
        self._lock = threading.Lock()
        self._socket: Optional[socket.socket] = None

    def call(self, *request: Any) -> Any:
        """Return the answer to a request, given as a message or by its fields in order.

        Raises:
            ServiceMissing: no node offers the service.
            ServiceUnreachable: there is no answer; the request was not carried out, unless the
                answer came too late, or the node ended before it.
        """
        kind = self._service._request_class
        is_one = len(request) == 1 and isinstance(request[0], kind)
        data = _serialized(request[0] if is_one else kind(*request))
        with self._lock:
            try:
                return self._service._response_class().deserialize(self._exchanged(data))
            except (*CONNECTION_ERRORS, _Gone, genpy.DeserializationError) as error:
                self._disconnect()
                problem = (ServiceMissing if isinstance(error, rosgraph.MasterError)
                           else ServiceUnreachable)
                raise problem(f'{self._name} does not answer: {error}') from error

    def wait(self, timeout_s: float, interrupted: Optional[threading.Event] = None) -> bool:
        """Wait until a node offers the service, by polling ten times a second: ROS sends no notice.

        Return False after the timeout, or if ``interrupted`` is set.
        """
        interrupted = interrupted or threading.Event()
        end_s = time.monotonic() + timeout_s
        while not self._is_offered():
            if time.monotonic() > end_s or interrupted.wait(_RETRY_S):
                return False
        return True

    def close(self) -> None:
        """Close the connection; the next call opens another one."""
        with self._lock:
            self._disconnect()

    def _is_offered(self) -> bool:
        try:
            self._master().lookupService(self._name)
        except (rosgraph.MasterException, OSError):
            return False
        return True

    def _master(self) -> MasterClient:
        return MasterClient(rospy.get_name(), self._master_uri, PATIENT_TIMEOUT_S)

    def _exchanged(self, data: bytes) -> bytes:
        """Return the bytes of the answer; look up a node again that has closed the connection.

        A request is sent only once: the node may have carried it out before it closed.
        """
        if self._socket is not None and _is_closed(self._socket):
            self._disconnect()
        if self._socket is None:
            self._socket = self._connect()
        return _exchange(self._socket, data)

    def _connect(self) -> socket.socket:
        connection, _ = connected_by_handshake(self._looked_up(), {
            'service': self._name, 'md5sum': self._service._md5sum,
            'callerid': rospy.get_name(), 'persistent': '1'}, self._timeout_s)
        return connection

    def _looked_up(self) -> Tuple[Optional[str], int]:
        try:
            address = urlsplit(self._master().lookupService(self._name))
        except (rosgraph.MasterException, OSError):
            if self._address is None:
                raise
            try:
                return self._address()
            except CONNECTION_ERRORS:
                pass
            raise
        return address.hostname, address.port or 0

    def _disconnect(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def _is_closed(connection: socket.socket) -> bool:
    """Return whether the other end has closed an idle connection, on which nothing is received."""
    poll = select.poll()
    poll.register(connection, select.POLLIN)
    return bool(poll.poll(0))


def _exchange(connection: socket.socket, data: bytes) -> bytes:
    try:
        connection.sendall(data)
        good, length = _HEAD.unpack(received(connection, _HEAD.size, _Gone))
        answer = received(connection, length, _Gone)
    except ConnectionError as error:
        raise _Gone(error) from error
    if not good:
        raise ValueError(answer.decode('utf-8', 'replace'))
    return answer


def _serialized(request: genpy.Message) -> bytes:
    buffer = io.BytesIO()
    request.serialize(buffer)
    return _LENGTH.pack(buffer.tell()) + buffer.getvalue()


State = TypeVar('State')


class NodeClient(Generic[State]):
    """Commands a node by its services and follows its state; needs an initialized rospy node.

    Every command waits for the node's answer; do not call it in the GUI thread. Connections are
    kept, and renewed after a restart of the node. ``on_state`` is called in rospy's thread.
    """

    REFUSED: ClassVar[Type[Exception]]
    UNREACHABLE: ClassVar[Type[Exception]]

    def __init__(self, node: str, state_class: Type[Any], services: Mapping[str, Type[Any]],
                 timeout_s: float, on_state: Optional[Callable[[State], None]] = None,
                 follow_now: bool = True, master_uri: Optional[str] = None) -> None:
        """Follow the state from now on (this waits for the master), or from ``begin`` on.

        A node on another master can be commanded, but not followed. A call fails if the node does
        not answer within the timeout.
        """
        self._node, self._state_class, self._on_state = node, state_class, on_state
        self._state: Optional[State] = None
        self._changed = threading.Condition()
        self._subscriber: Optional[rospy.Subscriber] = None
        self._services = {
            name: ServiceConnection(f'{node}/{name}', service, timeout_s, master_uri,
                                    self._address if master_uri is None else None)
            for name, service in services.items()}
        if follow_now:
            self.begin()

    def begin(self) -> None:
        """Start following the state, if the constructor did not; waits for the master."""
        self._subscriber = rospy.Subscriber(f'{self._node}/state', self._state_class, self._take)

    @property
    def state(self) -> Optional[State]:
        """The last state; None before the first one."""
        return self._state

    def close(self) -> None:
        """Stop following the state and close the connections; the node continues."""
        if self._subscriber is not None:
            self._subscriber.unregister()
        for service in self._services.values():
            service.close()

    def wait_for(self, condition: Callable[[State], bool],
                 timeout_s: Optional[float] = None) -> Optional[State]:
        """Wait for a state that fulfills a condition; return it, or None after the timeout."""
        with self._changed:
            fulfilled = self._changed.wait_for(
                lambda: self._state is not None and condition(self._state), timeout_s)
            return self._state if fulfilled else None

    def _wait_for_service(self, name: str, timeout_s: float, program: str) -> None:
        if not self._services[name].wait(timeout_s):
            raise self.UNREACHABLE(f'{self._node} is not running; start it with '
                                   f'"rosrun process_visualizer {program}"')

    def _answer(self, name: str, *request: object) -> Any:
        """Return the answer of a service; raise UNREACHABLE, or REFUSED with the node's reason."""
        try:
            answer = self._services[name].call(*request)
        except ServiceUnreachable as error:
            raise self.UNREACHABLE(str(error)) from error
        if not answer.success:
            raise self.REFUSED(answer.message)
        return answer

    def _address(self) -> Tuple[str, int]:
        """Return host and port of the state's publisher, which also offers the services there.

        The master is not asked: it may have died, or been restarted.

        Raises:
            CONNECTION_ERRORS: no node sends the topic, or the node does not answer.
        """
        return connected_publisher(rospy.get_node_uri(), rospy.get_name(), f'{self._node}/state',
                                   PATIENT_TIMEOUT_S)

    def _take(self, state: State) -> None:
        with self._changed:
            self._state = state
            self._changed.notify_all()
        if self._on_state is not None:
            self._on_state(state)
