# SPDX-License-Identifier: BSD-3-Clause
"""Topics that another node publishes with another type or definition, and what others publish."""
from __future__ import annotations

import http.client
import io
import socket
from typing import Any, Collection, Dict, List, Sequence, Tuple
from xmlrpc.client import Error, ServerProxy

import rosgraph
import rospy
from rosgraph.network import (
    ROSHandshakeException,
    read_ros_handshake_header,
    write_ros_handshake_header,
)

from process_visualizer.health.other_publishers import Others, other_publishers
from process_visualizer.launching.asked_master import AskedMaster
from process_visualizer.launching.limited_transport import LimitedTransport
from process_visualizer.player.bag_publishers import PublishedTopic

_TIMEOUT_S = 2.0
_ANY = '*'


class OtherNodes:
    """The other nodes, as the master and they themselves know them."""

    def publishing(self) -> Dict[str, List[str]]:
        """Return the nodes that publish each topic.

        Raises:
            rosgraph.MasterException: the master cannot be reached.
        """
        publishers, _, _ = _master().getSystemState()
        return dict(publishers)

    def header(self, topic: str, node: str) -> Dict[str, str]:
        """Return the header that a publisher sends to a subscriber; empty if it does not answer."""
        try:
            address = _master().lookupNode(node)
            node_api: Any = ServerProxy(address, LimitedTransport(_TIMEOUT_S))
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

    def beside(self, topics: Collection[str]) -> Others:
        """Return who publishes topics beside this node.

        Raises:
            rosgraph.MasterException, OSError: the master does not answer.
        """
        return other_publishers(topics, {rospy.get_name()})


def without_conflicts(topics: Sequence[PublishedTopic],
                      others: OtherNodes) -> Tuple[List[PublishedTopic], List[str]]:
    """Return the topics that can be published beside other nodes, and why others cannot.

    The publishers themselves are asked: the master remembers types of those that have gone.

    Raises:
        rosgraph.MasterException: the master cannot be reached.
    """
    nodes = others.publishing()
    kept, problems = [], []
    for topic in topics:
        problem = _conflict(topic, nodes.get(topic.name, []), others)
        if problem:
            problems.append(problem)
        else:
            kept.append(topic)
    return kept, problems


def _conflict(topic: PublishedTopic, nodes: Sequence[str], others: OtherNodes) -> str:
    ours = topic.connection
    advice = f'give it another name ({topic.name}:=/other) or a prefix (-p)'
    for node in nodes:
        header = others.header(topic.name, node)
        type_name, md5sum = header.get('type', ours.type), header.get('md5sum', ours.md5sum)
        if type_name != ours.type:
            return (f'{topic.name}: left out, as it is {ours.type} in the recording, but '
                    f'{type_name} where {node} publishes it; {advice}')
        if md5sum != ours.md5sum:
            return (f'{topic.name}: left out, as the definition of {ours.type} in the recording '
                    f'({ours.md5sum}) is not that of {node} ({md5sum}); {advice}')
    return ''


def _master() -> AskedMaster:
    return AskedMaster(rospy.get_name(), timeout_s=_TIMEOUT_S)
