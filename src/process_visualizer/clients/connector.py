# SPDX-License-Identifier: BSD-3-Clause
"""A node's connections to publishers, even after a shortage of threads or memory."""
from __future__ import annotations

import _thread
import threading
import time
from typing import Any, Dict, List, Tuple

import rosgraph
import rospy
from rosgraph.xmlrpc import XmlRpcNode
from rospy.impl.registration import get_topic_manager

from process_visualizer.launching.ros_api import PATIENT_TIMEOUT_S, MasterClient
from process_visualizer.shown_text import shown

_RETRY_S, _LOOK_S = 0.5, 0.5


class Connector:
    """Connects a node to the publishers that the master reports, even after a shortage.

    rospy's own thread ends when it cannot start another one for a connection. From then on the node
    would miss every new publisher, such as a restarted driver.
    """

    def __init__(self, handler: Any) -> None:
        """``handler`` is the node's handler, which makes the connections."""
        self._handler = handler
        self._changed = threading.Condition()
        self._updates: List[str] = []
        self._publishers: Dict[str, List[str]] = {}
        self._is_behind = False

    def ask_again(self) -> None:
        """Ask the master for all publishers soon, as one of its messages may have been lost."""
        self._is_behind = True

    def publisher_update(self, resolved_name: str, uris: List[str]) -> None:
        """Note the present publishers of a topic; replaces RegManager's method."""
        with self._changed:
            self._publishers[resolved_name] = uris
            self._updates.append(resolved_name)
            self._changed.notify_all()

    def run(self) -> None:
        """Make connections until the shutdown."""
        while not (self._handler.done or rospy.is_shutdown()):
            topic = ''
            try:
                if self._is_behind:
                    self._ask_master()
                topic = self._next_topic()
                for uri in self._publishers.get(topic, ()):
                    _thread.start_new_thread(self._connect, (topic, uri))
            except (OSError, MemoryError, RuntimeError) as error:
                self._connect_later(topic, error)

    def _ask_master(self) -> None:
        """Get the present publishers of all topics from the master."""
        time.sleep(_RETRY_S)  # more messages may be lost in the meantime
        self._is_behind = False
        try:
            master = MasterClient(rospy.get_name(), timeout_s=PATIENT_TIMEOUT_S)
            publishers = dict(master.getSystemState()[0])
            for topic, _ in get_topic_manager().get_subscriptions():
                self.publisher_update(
                    topic, [master.lookupNode(it) for it in publishers.get(topic, ())])
        except (OSError, MemoryError, ValueError, rosgraph.MasterException):
            self._is_behind = True

    def _next_topic(self) -> str:
        """Wait briefly for a topic with new publishers; return '' if there is none."""
        with self._changed:
            if not self._updates:
                self._changed.wait(_LOOK_S)
            topic = self._updates.pop() if self._updates else ''
            self._updates = [it for it in self._updates if it != topic]
        return topic

    def _connect(self, topic: str, uri: str) -> None:
        try:
            self._handler._connect_topic(topic, uri)
        except (MemoryError, RuntimeError) as error:
            self._remove_unstarted(topic, uri)
            self._connect_later(topic, error)
        except Exception as error:
            rospy.logdebug('no connection to %s for %s: %s', uri, topic, error)

    def _remove_unstarted(self, topic: str, uri: str) -> None:
        """Remove a connection whose thread could not be started: it would count as connected."""
        subscription = get_topic_manager().get_subscriber_impl(topic)
        for it in [] if subscription is None else subscription.connections[:]:
            if it.endpoint_id == uri and it.socket is None:
                subscription.remove_connection(it)

    def _connect_later(self, topic: str, error: Exception) -> None:
        rospy.logwarn('%s: no connection: %s', topic, shown(repr(error)))
        time.sleep(_RETRY_S)  # retrying sooner does not end a shortage
        with self._changed:
            if topic:
                self._updates.insert(0, topic)


def connect_patiently() -> List[Tuple[Any, Connector]]:
    """Start the connector of this process's node; call this after ``rospy.init_node``.

    rospy continues to register and unregister topics. Returns rospy's node object with the
    connector; an empty list if there is no node yet.
    """
    found = []
    for hook in rospy.core._shutdown_hooks:
        node = getattr(hook, '__self__', None)
        if isinstance(node, XmlRpcNode) and node.server is not None:
            connector = Connector(node.handler)
            node.handler.reg_man.publisher_update = connector.publisher_update
            _thread.start_new_thread(connector.run, ())
            found.append((node, connector))
    return found
