# SPDX-License-Identifier: BSD-3-Clause
"""The servers of a rospy node: one for topics and services, and one for XML-RPC questions.

rospy's own servers end or hang at a shortage of memory, threads or files, although their process
keeps running; and while a connection sends no header, all others wait. Threads are started here
without waiting until they run, unlike threading.Thread: a thread without memory to run never
reports it.
"""
from __future__ import annotations

import _thread
import errno
import socket
import struct
import threading
import time
from typing import Any, Callable

import rospy
from rosgraph.xmlrpc import ThreadingXMLRPCServer
from rospy.impl.tcpros_base import TCPServer, init_tcpros_server

from process_visualizer.clients.connector import connect_patiently
from process_visualizer.shown_text import shown

_RETRY_S = 0.5
_HEADER_WITHIN_S, _MAX_WAITING, _MAX_HEADER_BYTES = 10, 100, 1 << 16
_LENGTH, _SOCKET_TIMEOUT = struct.Struct('<I'), struct.Struct('ll')


class NodeServer(TCPServer):
    """Passes each connection on in a thread of its own, once its header has arrived."""

    def __init__(self, inbound_handler: Any) -> None:
        """Listen; ``inbound_handler`` handles a connection, given with the address of its peer."""
        super().__init__(self._handle)
        self._inbound_handler = inbound_handler
        self._room = threading.BoundedSemaphore(_MAX_WAITING)

    def run(self) -> None:
        """Accept connections until the shutdown, even after a shortage."""
        while not self.is_shutdown:
            try:
                super().run()
            except (OSError, MemoryError, RuntimeError) as error:
                if self.is_shutdown or getattr(error, 'errno', None) == errno.EBADF:
                    return
                rospy.logerr('a connection was lost, and others may have been: %s. If this '
                             'continues, restart the node', shown(repr(error)))
                time.sleep(_RETRY_S)  # retrying sooner does not end a shortage

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
    """Wait a limited time for the whole header of a connection, without consuming it."""
    whole = socket.MSG_PEEK | socket.MSG_WAITALL
    timeout_s = connection.gettimeout()  # rospy sets a default for all sockets when it subscribes
    try:
        connection.settimeout(None)  # with a timeout, Python does not wait for all bytes
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, _SOCKET_TIMEOUT.pack(
            _HEADER_WITHIN_S, 0))
        size = connection.recv(_LENGTH.size, whole)
        if len(size) < _LENGTH.size or _LENGTH.unpack(size)[0] > _MAX_HEADER_BYTES:
            return False
        end = _LENGTH.size + _LENGTH.unpack(size)[0]
        is_whole = len(connection.recv(end, whole)) == end
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, _SOCKET_TIMEOUT.pack(0, 0))
        connection.settimeout(timeout_s)
    except OSError:  # the peer has closed the connection, or sent nothing
        return False
    return is_whole


class QuestionServer(ThreadingXMLRPCServer):
    """Answers the questions of the master and of other nodes, even after a shortage."""

    def __init__(self, before: Any, handler: Any,
                 lose: Callable[[], None] = lambda: None) -> None:
        """Replace a ThreadingXMLRPCServer, using its socket; ``handler`` answers.

        ``lose`` is called when a question could not be accepted; it may have been a publisher
        update.
        """
        super().__init__(('localhost', 0), 0)
        self._lose = lose
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
            self._lose()
            raise


def serve_patiently() -> None:
    """Give this process a server for connections; call this before ``rospy.init_node``."""
    server = init_tcpros_server()
    server.tcp_ros_server = NodeServer(server._tcp_server_callback)
    server.tcp_ros_server.start()


def answer_patiently() -> None:
    """Give this node a server for questions; call this after ``rospy.init_node``.

    The node then connects to publishers as in `connect_patiently`.
    """
    for node, connector in connect_patiently():
        before, node.server = node.server, QuestionServer(node.server, node.handler,
                                                          connector.ask_again)
        # The node's thread then runs its new server. Do not wait for the shutdown: it never returns
        # if that thread has not yet run the old server.
        threading.Thread(target=before.shutdown, name='end of a server', daemon=True).start()
