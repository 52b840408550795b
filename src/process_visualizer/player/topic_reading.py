# SPDX-License-Identifier: BSD-3-Clause
"""The service for reading the recording, for nodes that need messages around a position."""
from __future__ import annotations

from typing import Dict, Sequence

import rospy

from process_visualizer.bags.recording import Recording
from process_visualizer.curves.topic_messages import (
    TopicMessages,
    topic_messages,
    topic_period_s,
)
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.playback.timeline import NS_PER_S
from process_visualizer.player.bag_publishers import PublishedTopic
from process_visualizer.srv import ReadTopic, ReadTopicRequest, ReadTopicResponse

LARGEST_BYTES = 1 << 20
_FARTHEST_S = 1e9  # from the beginning of a recording; times further away are none


class TopicReadingService:
    """Offers ~read: the messages of a topic between two positions, as they were recorded."""

    def __init__(self, recording: Recording, topics: Sequence[PublishedTopic],
                 node: NodeHandle) -> None:
        """Advertise it for the topics that are played."""
        self._recording = recording
        self._begin_ns = recording.begin_ns
        self._topics = {node.resolve(topic.name): topic for topic in topics}
        self._periods_s: Dict[str, float] = {}
        self._service = node.serve('~read', ReadTopic, self._read)

    def close(self) -> None:
        """Shut the service down."""
        self._service.shutdown()

    def _read(self, request: ReadTopicRequest) -> ReadTopicResponse:
        topic = self._topics.get(request.topic)
        if topic is None:
            return ReadTopicResponse(success=False, message=f'{request.topic} is not played')
        if not -_FARTHEST_S < request.begin <= request.end < _FARTHEST_S:
            return ReadTopicResponse(success=False, message='begin and end must be positions in '
                                     f's, not {request.begin} and {request.end}')
        return self._answer(topic, topic_messages(
            self._recording, topic.numbers, self._bag_ns(request.begin),
            self._bag_ns(request.end), LARGEST_BYTES))

    def _answer(self, topic: PublishedTopic, found: TopicMessages) -> ReadTopicResponse:
        return ReadTopicResponse(
            success=True, type=topic.connection.type,
            recording_begin=rospy.Time(*divmod(self._begin_ns, NS_PER_S)),
            end=self._position_s(found.end_ns), period=self._period_s(topic),
            positions=[self._position_s(time_ns) for time_ns in found.times_ns],
            sizes=[len(message) for message in found.messages],
            data=b''.join(found.messages))

    def _period_s(self, topic: PublishedTopic) -> float:
        if topic.name not in self._periods_s:
            self._periods_s[topic.name] = topic_period_s(self._recording, topic.numbers)
        return self._periods_s[topic.name]

    def _bag_ns(self, position_s: float) -> int:
        return self._begin_ns + round(position_s * NS_PER_S)

    def _position_s(self, bag_ns: int) -> float:
        return (bag_ns - self._begin_ns) / NS_PER_S
