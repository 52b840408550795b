# SPDX-License-Identifier: BSD-3-Clause
"""Finds topics that another node publishes with another type or definition."""
from __future__ import annotations

import http.client
import io
import socket
from typing import Any, Dict, List, Sequence, Tuple
from xmlrpc.client import Error, ServerProxy, Transport

import rosgraph
import rospy
from rosgraph.network import (
    ROSHandshakeException,
    read_ros_handshake_header,
    write_ros_handshake_header,
)

from process_visualizer.player.bag_publishers import PublishedTopic

_TIMEOUT_S = 2.0
_ANY = '*'


def without_conflicts(topics: Sequence[PublishedTopic]) -> Tuple[List[PublishedTopic], List[str]]:
    """Return the topics that can be published beside other nodes, and why others cannot.

    The publishers themselves are asked: the master remembers types of those that have gone.

    Raises:
        rosgraph.MasterException: the master cannot be reached.
    """
    master = rosgraph.Master(rospy.get_name())
    publishers, _, _ = master.getSystemState()
    nodes = dict(publishers)
    kept, problems = [], []
    for topic in topics:
        problem = _conflict(topic, nodes.get(topic.name, []), master)
        if problem:
            problems.append(problem)
        else:
            kept.append(topic)
    return kept, problems


def _conflict(topic: PublishedTopic, nodes: Sequence[str], master: rosgraph.Master) -> str:
    ours = topic.connection
    advice = f'give it another name ({topic.name}:=/other) or a prefix (-p)'
    for node in nodes:
        header = _publisher_header(topic.name, node, master)
        type_name, md5sum = header.get('type', ours.type), header.get('md5sum', ours.md5sum)
        if type_name != ours.type:
            return (f'{topic.name}: left out, as it is {ours.type} in the recording, but '
                    f'{type_name} where {node} publishes it; {advice}')
        if md5sum != ours.md5sum:
            return (f'{topic.name}: left out, as the definition of {ours.type} in the recording '
                    f'({ours.md5sum}) is not that of {node} ({md5sum}); {advice}')
    return ''


def _publisher_header(topic: str, node: str, master: rosgraph.Master) -> Dict[str, str]:
    """The header that a publisher sends to a subscriber; empty if it does not answer."""
    try:
        node_api: Any = ServerProxy(master.lookupNode(node), _ImpatientTransport())
        _, _, protocol = node_api.requestTopic(rospy.get_name(), topic, [['TCPROS']])
        _, host, port = protocol
        with socket.create_connection((host, port), _TIMEOUT_S) as peer:
            write_ros_handshake_header(peer, {
                'topic': topic, 'type': _ANY, 'md5sum': _ANY, 'callerid': rospy.get_name(),
                'message_definition': ''})
            header: Dict[str, str] = read_ros_handshake_header(peer, io.BytesIO(), 65536)
        return header
    except (OSError, ValueError, TypeError, Error, http.client.HTTPException,
            rosgraph.MasterException, ROSHandshakeException) as error:
        rospy.logdebug('%s does not say what it publishes on %s: %s', node, topic, error)
        return {}  # it has gone, or speaks otherwise: no reason not to play


class _ImpatientTransport(Transport):
    """Gives up on a node that does not answer: it may have been killed."""

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = _TIMEOUT_S
        return connection
