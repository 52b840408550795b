# SPDX-License-Identifier: BSD-3-Clause
"""The relay: lets other computers watch the running cell without changing anything in it.

Viewers connect to one port and receive what the cell's view shows, with models and meshes. They
never connect to a driver, so no viewer can delay one; messages that a link cannot carry are left
out here.
"""
from __future__ import annotations

import argparse
import os
import select
import socket
import sys
import threading
import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Dict, List, Optional, Set, Tuple
from urllib.parse import urlsplit

import rosgraph
import rospkg
import rospy

from process_visualizer.bagio.message_definition import Connection, installed_connection
from process_visualizer.launching.ros_api import PATIENT_TIMEOUT_S, MasterClient, addresses_of
from process_visualizer.nodes.common.node_handle import spin_to_end, start_node
from process_visualizer.nodes.viewer_link import Files, TopicFeed, ViewerLink
from process_visualizer.remote.link_words import (
    hidden_from_others,
    how_to_watch,
    is_loopback,
    listening_address,
    ports_of,
)
from process_visualizer.remote.offer import (
    DEFAULT_PORTS,
    MAX_MESH_BYTES,
    Offer,
    OfferedTopic,
    named_topics,
)
from process_visualizer.remote.packets import GREETING, Kind, json_packet
from process_visualizer.remote.shown_view import (
    mesh_paths,
    model_parameters,
    offered_meshes,
    parsed_view,
)
from process_visualizer.ros_names import PACKAGE, STATIC_TF_TOPIC, TF_TOPIC, VIEW_RELAY
from process_visualizer.shortage import shortage_words
from process_visualizer.whole_file import small_file

_MAX_VIEWERS = 16
_FULL = f'{_MAX_VIEWERS} viewers watch this cell already'
_GIVES_WAY_S = 1.5
"""Silence [s] after which a viewer gives way, as its link is lost; viewers send twice a second."""
_GREETS_S = 6.0
_MAX_WAITING = 64
"""Maximum number of connections that have sent nothing; beyond it, the oldest ones are closed."""
_TOPICS_PERIOD_S = 1.0
_FRESH_S = 1.0
"""Time [s] for which an offer is reused: many viewers may connect at the same time."""
_Made = Tuple[Offer, Files, Dict[str, OfferedTopic]]


class ViewRelay:
    """Listens for viewers; every connection has its own threads."""

    def __init__(self, address: str, ports: range, view_file: str, mode: str) -> None:
        """Listen at an address, on the first of some ports that is free.

        ``view_file`` is the .rviz file of the cell; it is read again when it has changed.

        Raises:
            OSError: the address cannot be used, or no port is free.
        """
        self._listener = _listening(address, ports)
        self._view_file, self._mode = view_file, mode
        self._master = MasterClient(rospy.get_name(), timeout_s=PATIENT_TIMEOUT_S)
        self._feed = TopicFeed()
        self._lock = threading.Lock()
        self._links: Set[ViewerLink] = set()
        self._waiting: Dict[socket.socket, None] = {}  # the oldest first
        self._offered: Optional[Tuple[str, Dict[str, str], Offer, Files]] = None
        self._making = threading.Lock()
        self._made: Tuple[float, str, Optional[_Made]] = (0.0, '', None)  # time, view, and result
        self._cell = f'{socket.gethostname()}:{urlsplit(rosgraph.get_master_uri()).port}'
        self._changed = threading.Event()
        self._ended = threading.Event()

    @property
    def address(self) -> str:
        """Return the address and port at which it listens."""
        host, port = self._listener.getsockname()[:2]
        return f'{host}:{port}'

    def run(self) -> None:
        """Begin to accept viewers; return at once."""
        for target in (self._accept, self._look_for_topics):
            threading.Thread(target=target, name=target.__name__, daemon=True).start()

    def close(self) -> None:
        """End all connections."""
        self._ended.set()
        self._changed.set()
        with suppress(OSError):  # it no longer listens
            self._listener.shutdown(socket.SHUT_RDWR)  # close alone would accept one more viewer
        self._listener.close()
        for link in self._present():
            link.close()

    def _present(self) -> List[ViewerLink]:
        with self._lock:
            return list(self._links)

    def _accept(self) -> None:
        while not self._ended.is_set():
            try:
                connection, where = self._listener.accept()
            except OSError as error:
                if self._ended.wait(1.0):
                    return
                rospy.logwarn('a viewer could not connect: %s', error.strerror)
                continue
            try:
                self._let_wait(connection)
                threading.Thread(target=self._welcome, args=[connection, f'{where[0]}:{where[1]}'],
                                 name=f'welcome {where[0]}', daemon=True).start()
            except (RuntimeError, MemoryError) as error:  # the viewer tries again
                with self._lock:
                    self._waiting.pop(connection, None)
                connection.close()
                rospy.logwarn('a viewer could not connect: %s', shortage_words(error) or error)

    def _let_wait(self, connection: socket.socket) -> None:
        """Add a waiting connection; close those that have waited longest if there are too many."""
        with self._lock:
            self._waiting[connection] = None
            while len(self._waiting) > _MAX_WAITING:
                oldest = next(iter(self._waiting))
                del self._waiting[oldest]
                with suppress(OSError):  # the peer has closed it
                    oldest.shutdown(socket.SHUT_RDWR)  # its thread closes it

    def _welcome(self, connection: socket.socket, name: str) -> None:
        is_viewer = _says_something(connection)
        with self._lock:
            self._waiting.pop(connection, None)
        if not is_viewer or not _greeted(connection):
            connection.close()
            return
        if not self._has_room():
            _refuse(connection, _FULL)
            return
        try:
            made = self._made_for(connection)
        except (OSError, rosgraph.MasterException) as error:
            _refuse(connection, f'its ROS master does not answer ({error}): check the cell')
            return
        except ValueError as error:
            _refuse(connection, f'its view cannot be shown: {error}')
            return
        if made is None:
            connection.close()
            return
        link = ViewerLink(connection, name, self._feed, self._forget)
        with self._lock:
            has_room = len(self._links) < _MAX_VIEWERS
            if has_room:
                self._links.add(link)
        if not has_room:  # other viewers were accepted meanwhile
            _refuse(connection, _FULL)
            return
        rospy.loginfo('%s watches', name)
        try:
            link.start(*made)
        except (OSError, RuntimeError, MemoryError):
            self._forget(link)
            link.close()
            connection.close()
        self._changed.set()

    def _has_room(self) -> bool:
        """Return whether one more may watch; silent ones give way, as they may be reconnecting."""
        if len(self._present()) >= _MAX_VIEWERS:
            for link in self._present():
                if link.silent_s > _GIVES_WAY_S:
                    self._forget(link)
                    link.close()
        return len(self._present()) < _MAX_VIEWERS

    def _forget(self, link: ViewerLink) -> None:
        with self._lock:
            self._links.discard(link)

    def _made_for(self, connection: socket.socket) -> Optional[_Made]:
        """Return the offer for a viewer; None if the viewer has given up meanwhile.

        One thread at a time makes the offer, for all waiting viewers: otherwise many viewers of a
        busy computer would delay each other until they give up.
        """
        with self._making:
            if _has_left(connection):
                return None
            view, now_s = self._view(), time.monotonic()
            made_s, of_view, made = self._made
            if made is None or of_view != view or now_s - made_s > _FRESH_S:
                made = (*self._offer(view), self._topics())
                self._made = time.monotonic(), view, made
            return made

    def _offer(self, view: str) -> Tuple[Offer, Files]:
        models = {}
        for name in model_parameters(view):
            if self._master.hasParam(name):
                models[name] = str(self._master.getParam(name))
        before = self._offered
        if before is not None and before[:2] == (view, models):
            return before[2:]  # reuse the meshes, so that a viewer reconnects faster
        paths = mesh_paths(models)
        version = rospkg.RosPack().get_manifest(PACKAGE).version
        offer = Offer(version, self._mode, view, models, offered_meshes(paths), self._cell)
        files = {uri: partial(_content, path) for uri, path in paths.items()}
        self._offered = view, models, offer, files
        return offer, files

    def _view(self) -> str:
        return Path(self._view_file).read_text(encoding='utf-8')

    def _topics(self) -> Dict[str, OfferedTopic]:
        """Return the topics that the view shows and that have a publisher."""
        view = parsed_view(self._view())
        more = rospy.get_param('~topics', [])
        if not isinstance(more, list):
            raise ValueError('~topics is not a list of names')
        wanted = {*named_topics(view), *map(str, more), TF_TOPIC, STATIC_TF_TOPIC}
        offered = {name: _topic(name, kind) for name, kind in self._master.getTopicTypes()
                   if name in wanted}
        return {name: topic for name, topic in offered.items() if topic is not None}

    def _look_for_topics(self) -> None:
        """Offer new topics, and a changed view, while a viewer is connected."""
        view = ''
        while not self._ended.is_set():
            if not self._present():
                self._changed.wait()
                self._changed.clear()
                view = ''  # new viewers get the present view anyway
            if self._ended.wait(_TOPICS_PERIOD_S):
                return
            try:
                present = self._view()
                offer = self._offer(present) if view and present != view else None
                topics = self._topics()
                view = present
                for link in self._present():
                    if offer is not None:
                        link.offer(*offer)
                    link.offer_topics(topics)
            except (OSError, ValueError, MemoryError, rosgraph.MasterException):
                continue  # the master or memory becomes available again, or the cell ends


def _topic(name: str, kind: str) -> Optional[OfferedTopic]:
    found: Optional[Connection] = installed_connection(name, kind)
    return (
        None if found is None else OfferedTopic(found.type, found.md5sum, found.message_definition)
    )


def _content(path: str) -> bytes:
    """Return the content of a file; empty if it is no longer there, or is no longer a file."""
    try:
        return small_file(path, MAX_MESH_BYTES)
    except OSError:
        return b''


def _says_something(connection: socket.socket) -> bool:
    """Return whether a first byte arrives: a viewer tries several connections and keeps one."""
    try:
        connection.settimeout(_GREETS_S)
        return bool(connection.recv(1, socket.MSG_PEEK))
    except OSError:
        return False


def _greeted(connection: socket.socket) -> bool:
    """Greet a viewer at once, so that it knows that there is a cell while the offer is made."""
    try:
        connection.settimeout(2.0)
        connection.sendall(GREETING)
    except OSError:
        return False  # the viewer has gone
    return True


def _has_left(connection: socket.socket) -> bool:
    """Return whether the viewer has closed a connection on which unread data may remain."""
    poll = select.poll()
    poll.register(connection, select.POLLRDHUP)
    return bool(poll.poll(0))


def _refuse(connection: socket.socket, reason: str) -> None:
    try:
        with connection:
            connection.settimeout(2.0)
            connection.sendall(json_packet(Kind.REFUSED, reason=reason))
    except OSError:
        return  # the viewer has gone


def _listening(address: str, ports: range) -> socket.socket:
    """Return a listening socket of the address's family."""
    problem: Optional[OSError] = None
    for port in ports:
        try:
            found = addresses_of(address, port)[0]
            listener = socket.socket(found[0], socket.SOCK_STREAM)
        except OSError as error:
            raise OSError(error.errno, f'{address}: {error.strerror}') from None
        try:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(found[4])
            listener.listen(_MAX_VIEWERS)
            return listener
        except OSError as error:
            listener.close()
            problem = error
    raise OSError(problem.errno if problem else 0,
                  f'{address}, port {ports[0]} to {ports[-1]}: '
                  f'{problem.strerror if problem else "none"}')


def main() -> None:
    """Run the node."""
    start_node(VIEW_RELAY)
    options = _options(rospy.myargv(sys.argv)[1:])
    address = listening_address(os.environ, options.remote)
    try:
        relay = ViewRelay(address, options.ports, options.view, options.mode)
    except OSError as error:
        rospy.logwarn('nobody can watch this cell with "cell view": it cannot listen at %s; '
                      'check ROS_IP and ROS_HOSTNAME, or give other --ports', error.strerror)
        rospy.set_param('~address', '')
        spin_to_end()
    rospy.set_param('~address', relay.address)
    rospy.loginfo('"cell view" can connect to %s', relay.address)
    hidden = hidden_from_others(os.environ)
    if hidden and not options.remote:
        rospy.logwarn('%s', hidden)
    if not is_loopback(address):
        print(how_to_watch(relay.address), file=sys.stderr, flush=True)  # "cell run" shows it
    relay.run()
    spin_to_end(relay.close)


def _options(words: List[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog=VIEW_RELAY)
    parser.add_argument('--remote', action='store_true')
    parser.add_argument('--ports', type=ports_of, default=DEFAULT_PORTS)
    parser.add_argument('--view', required=True)
    parser.add_argument('--mode', default='')
    return parser.parse_args(words)
