"""Finds topics that somebody else publishes or expects with another type or definition."""
from __future__ import annotations

import http.client
import io
import socket
from typing import Any, Dict, List, Optional, Sequence, Tuple
from xmlrpc.client import Error, ServerProxy, Transport

import rosgraph
import rospy
from rosgraph.network import (
    ROSHandshakeException,
    read_ros_handshake_header,
    write_ros_handshake_header,
)

from process_visualizer.nodes.bag_publishers import PublishedTopic

_TIMEOUT_S = 2.0
_ANY = '*'


def without_conflicts(topics: Sequence[PublishedTopic]) -> Tuple[List[PublishedTopic], List[str]]:
    """Return the topics that can be published beside what runs, and as texts why others cannot.

    Raises:
        rosgraph.MasterException: the master cannot be reached.
    """
    master = rosgraph.Master(rospy.get_name())
    types = dict(master.getTopicTypes())
    publishers, _, _ = master.getSystemState()
    kept, problems = [], []
    for topic in topics:
        problem = _conflict(topic, types.get(topic.name, _ANY),
                            dict(publishers).get(topic.name, []), master)
        if problem:
            problems.append(problem)
        else:
            kept.append(topic)
    return kept, problems


def _conflict(topic: PublishedTopic, type_name: str, publishers: Sequence[str],
              master: rosgraph.Master) -> str:
    ours = topic.connection
    if type_name not in (_ANY, ours.type):
        by = f'by {", ".join(publishers)}' if publishers else 'by a subscriber'
        return (f'{topic.name}: left out, as it is {ours.type} in the recording, but used as '
                f'{type_name} {by}; give it another name ({topic.name}:=/other) or a prefix (-p)')
    for node in publishers:
        md5sum = _published_md5sum(topic.name, node, master)
        if md5sum not in (None, _ANY, ours.md5sum):
            return (f'{topic.name}: left out, as the definition of {ours.type} in the recording '
                    f'({ours.md5sum}) is not that of {node} ({md5sum}); give it another name '
                    f'({topic.name}:=/other) or a prefix (-p)')
    return ''


def _published_md5sum(topic: str, node: str, master: rosgraph.Master) -> Optional[str]:
    """What a publisher says when asked as a subscriber would; None if it does not answer."""
    try:
        uri = master.lookupNode(node)
        node_api: Any = ServerProxy(uri, _ImpatientTransport())
        _, _, protocol = node_api.requestTopic(rospy.get_name(), topic, [['TCPROS']])
        _, host, port = protocol
        with socket.create_connection((host, port), _TIMEOUT_S) as peer:
            write_ros_handshake_header(peer, {
                'topic': topic, 'type': _ANY, 'md5sum': _ANY, 'callerid': rospy.get_name(),
                'message_definition': ''})
            header: Dict[str, str] = read_ros_handshake_header(peer, io.BytesIO(), 65536)
        return header.get('md5sum')
    except (OSError, ValueError, TypeError, Error, http.client.HTTPException,
            rosgraph.MasterException, ROSHandshakeException):
        return None  # it has gone, or speaks otherwise: no reason not to play


class _ImpatientTransport(Transport):
    """Gives a node up that does not answer: it may have been killed."""

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = _TIMEOUT_S
        return connection
