# SPDX-License-Identifier: BSD-3-Clause
"""Servers of a rospy node, for topics and services and for questions (XML-RPC), and its clients.

rospy's own servers end or hang at a shortage of memory, threads or files, although their process
goes on, and while a connection sends no header, all others wait. A thread is started here without
waiting for its beginning, as threading.Thread does: one that has no memory to begin never says so.
The same holds for the thread in which rospy connects to publishers: it would end.
"""
from __future__ import annotations

import _thread
import errno
import socket
import struct
import threading
import time
from typing import Any, Dict, List

import rosgraph
import rospy
import rospy.impl.masterslave
from rosgraph.xmlrpc import ThreadingXMLRPCServer, XmlRpcNode
from rospy.impl.registration import RegManager, get_topic_manager
from rospy.impl.tcpros_base import TCPServer, init_tcpros_server

from process_visualizer.launching.ros_api import PATIENT_TIMEOUT_S, AskedMaster
from process_visualizer.shown_text import shown

_RETRY_S = 0.5
_HEADER_WITHIN_S, _MAX_WAITING, _MAX_HEADER_BYTES = 10, 100, 1 << 16
_LOOK_S = 0.5
_LENGTH, _SOCKET_TIMEOUT = struct.Struct('<I'), struct.Struct('ll')


class NodeServer(TCPServer):
    """Passes each connection on in a thread of its own, once its header has arrived."""

    def __init__(self, inbound_handler: Any) -> None:
        """Listen; ``inbound_handler`` takes a connection and the address of the other side."""
        super().__init__(self._handle)
        self._inbound_handler = inbound_handler
        self._room = threading.BoundedSemaphore(_MAX_WAITING)

    def run(self) -> None:
        """Accept connections until the shutdown, also after a shortage."""
        while not self.is_shutdown:
            try:
                super().run()
            except (OSError, MemoryError, RuntimeError) as error:
                if self.is_shutdown or getattr(error, 'errno', None) == errno.EBADF:
                    return
                rospy.logerr('a connection was lost, and others may have been: %s. If this goes '
                             'on, start the node again', shown(repr(error)))
                time.sleep(_RETRY_S)  # a shortage does not end sooner because of another try

    def _handle(self, connection: socket.socket, address: Any) -> None:
        try:
            _thread.start_new_thread(self._greet, (connection, address))
        except RuntimeError:
            connection.close()
            raise

    def _greet(self, connection: socket.socket, address: Any) -> None:
        if not self._room.acquire(blocking=False):
            connection.close()
            return
        try:
            if _has_header(connection):
                self._inbound_handler(connection, address)
            else:
                connection.close()
        finally:
            self._room.release()


def _has_header(connection: socket.socket) -> bool:
    """Wait a limited time for the whole header of a connection, and leave it to be read."""
    whole = socket.MSG_PEEK | socket.MSG_WAITALL
    timeout_s = connection.gettimeout()  # rospy sets a default for all sockets when it subscribes
    try:
        connection.settimeout(None)  # with one, Python does not wait for the whole
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, _SOCKET_TIMEOUT.pack(
            _HEADER_WITHIN_S, 0))
        size = connection.recv(_LENGTH.size, whole)
        if len(size) < _LENGTH.size or _LENGTH.unpack(size)[0] > _MAX_HEADER_BYTES:
            return False
        end = _LENGTH.size + _LENGTH.unpack(size)[0]
        is_whole = len(connection.recv(end, whole)) == end
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, _SOCKET_TIMEOUT.pack(0, 0))
        connection.settimeout(timeout_s)
    except OSError:  # the other side has gone, or sent nothing
        return False
    return is_whole


class QuestionServer(ThreadingXMLRPCServer):
    """Answers the questions of the master and of other nodes, also after a shortage."""

    def __init__(self, before: Any, handler: Any) -> None:
        """Take the place of a ThreadingXMLRPCServer, with its socket; ``handler`` answers."""
        super().__init__(('localhost', 0), 0)
        self._handler = handler
        own: Any = self
        own.socket.close()
        own.socket = before.socket
        self.register_multicall_functions()
        self.register_instance(handler)

    def serve_forever(self, poll_interval: float = 0.5) -> None:
        """Answer until the shutdown."""
        while True:
            try:
                super().serve_forever(poll_interval)
                return
            except MemoryError:
                time.sleep(_RETRY_S)

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer in a thread of its own."""
        try:
            _thread.start_new_thread(self.process_request_thread, (request, client_address))
        except (MemoryError, RuntimeError):
            registrations = getattr(self._handler, 'reg_man', None)
            if isinstance(registrations, Registrations):
                registrations.ask_again()
            raise


class Registrations(RegManager):
    """Connects to the publishers that the master names, also after a shortage.

    rospy's thread ends when it cannot start another one for a connection: the node would hear of no
    new publisher any more, such as a driver that is started again.
    """

    def __init__(self, handler: Any) -> None:
        """``handler`` is the node's, which connects."""
        super().__init__(handler)
        self.updates: List[Any] = []
        self._publishers: Dict[str, List[str]] = {}
        self._is_behind = False

    def ask_again(self) -> None:
        """Ask the master soon for all publishers, as a message of it may have been lost."""
        self._is_behind = True

    def publisher_update(self, resolved_name: str, uris: List[str]) -> None:
        """Take the present publishers of a topic."""
        self._publishers[resolved_name] = uris
        super().publisher_update(resolved_name, uris)

    def run(self) -> None:
        """Connect until the shutdown."""
        while not (self.handler.done or rospy.is_shutdown()):
            topic = ''
            try:
                if self._is_behind:
                    self._ask_master()
                topic = self._next_topic()
                get_topic_manager().check_all()
                for uri in self._publishers.get(topic, ()):
                    _thread.start_new_thread(self._connect, (topic, uri))
            except (OSError, MemoryError, RuntimeError) as error:
                self._connect_later(topic, error)

    def _ask_master(self) -> None:
        """Take the present publishers of all topics from the master."""
        time.sleep(_RETRY_S)  # more may have been lost, or may be lost still
        self._is_behind = False
        try:
            master = AskedMaster(rospy.get_name(), self.master_uri, PATIENT_TIMEOUT_S)
            publishers = dict(master.getSystemState()[0])
            for topic, _ in get_topic_manager().get_subscriptions():
                self.publisher_update(
                    topic, [master.lookupNode(it) for it in publishers.get(topic, ())])
        except (OSError, MemoryError, ValueError, rosgraph.MasterException):
            self._is_behind = True

    def _next_topic(self) -> str:
        """Wait for a topic with new publishers, not for long; '': there is none."""
        with self.cond:
            if not self.updates:
                self.cond.wait(_LOOK_S)
            topic = str(self.updates.pop()[0]) if self.updates else ''
            self.updates = [it for it in self.updates if it[0] != topic]
        return topic

    def _connect(self, topic: str, uri: str) -> None:
        try:
            self.handler._connect_topic(topic, uri)
        except (MemoryError, RuntimeError) as error:
            self._drop_unbegun(topic, uri)
            self._connect_later(topic, error)
        except Exception as error:
            rospy.logdebug('no connection to %s for %s: %s', uri, topic, error)

    def _drop_unbegun(self, topic: str, uri: str) -> None:
        """Drop a connection whose thread could not be started: it would count as connected."""
        subscription = get_topic_manager().get_subscriber_impl(topic)
        for it in [] if subscription is None else subscription.connections[:]:
            if it.endpoint_id == uri and it.socket is None:
                subscription.remove_connection(it)

    def _connect_later(self, topic: str, error: Exception) -> None:
        rospy.logwarn('%s: no connection: %s', topic, shown(repr(error)))
        time.sleep(_RETRY_S)  # a shortage does not end sooner because of another try
        with self.cond:
            if topic:
                self.updates.insert(0, (topic, self._publishers.get(topic, [])))


def connect_patiently() -> None:
    """Let the node of this process connect also after a shortage; before ``rospy.init_node``."""
    rospy.impl.masterslave.RegManager = Registrations


def serve_patiently() -> None:
    """Give this process a server for connections; to be called before ``rospy.init_node``."""
    connect_patiently()
    server = init_tcpros_server()
    server.tcp_ros_server = NodeServer(server._tcp_server_callback)
    server.tcp_ros_server.start()


def answer_patiently() -> None:
    """Give this node a server for questions; to be called after ``rospy.init_node``."""
    for hook in rospy.core._shutdown_hooks:
        node = getattr(hook, '__self__', None)
        if isinstance(node, XmlRpcNode) and node.server is not None:
            before, node.server = node.server, QuestionServer(node.server, node.handler)
            # The node's thread then lets its new server serve. Not waited for: if that thread has
            # not let the old one serve yet, its shutdown never returns.
            threading.Thread(target=before.shutdown, name='end of a server', daemon=True).start()
