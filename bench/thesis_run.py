# SPDX-License-Identifier: BSD-3-Clause
"""One run of the thesis' test: the simulated cell is recorded, and the recording is played."""
from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Dict, List, NamedTuple, Sequence

import numpy as np
import rospy
from arrival_recorder import ArrivalRecorder
from geometry_msgs.msg import TwistStamped
from velocity import TOPICS, VELOCITY, running_cell

from process_visualizer.bagio.recording import Recording
from process_visualizer.clients.bag_recorder import BagRecorder, RecordingOptions
from process_visualizer.clients.player_client import PlayerClient
from process_visualizer.nodes.robot.message_reader import float32_values

_DEVICES_WITHOUT_KINECT = 'ur_rt_upper,ur_rt_lower,sewing_machine,cell_stand,simulator'
_WARM_UP_S = 10.0  # until every node has started and the first images are drawn
_TIMEOUT_S = 60.0
_EDGE_S = 0.002  # less than half of the shortest step
_LATE_S = 60.0  # maximum delay at the end of a player that cannot keep up


class Stream(NamedTuple):
    """Messages of a topic: arrival times (n,) [s] and numbers (n, k); k may be 0."""

    time_s: np.ndarray
    values: np.ndarray

    @property
    def rate_hz(self) -> float:
        """Return messages per second from the first to the last; 0 for fewer than two."""
        return rate_hz(self.time_s)

    def since(self, begin_s: float) -> 'Stream':
        """Return the same with times since another one."""
        return Stream(self.time_s - begin_s, self.values)

    def steps_s(self) -> np.ndarray:
        """Return the time from each message to the next (n - 1,) [s]."""
        return np.diff(self.time_s)


class ThesisRun(NamedTuple):
    """All topics of the cell at a rate of images.

    ``published`` and ``played`` were received by a subscriber, with times since the first message
    of the recording or of play. ``recorded`` are the times in the bag (n,) [s], ``velocity`` the
    velocities of the lower tool while it was played: x y z [m/s] at their stamps. ``dropped`` is
    the number of played messages that the player dropped for slow subscribers.
    """

    image_hz: int
    published: Dict[str, Stream]
    recorded: Dict[str, np.ndarray]
    played: Dict[str, Stream]
    velocity: Stream
    dropped: int


def rate_hz(time_s: np.ndarray) -> float:
    """Return messages per second between the ends of times (n,) [s]; 0 for fewer than two."""
    return (len(time_s) - 1) / float(time_s[-1] - time_s[0]) if len(time_s) > 1 else 0.0


def thesis_run(image_hz: int, seconds: float, rviz: bool, folder: Path) -> ThesisRun:
    """Record the cell for some seconds, play the bag, and delete it."""
    topics = [topic for topic in TOPICS if image_hz or '/camera/' not in topic]
    bag = str(folder / f'thesis_{image_hz}.bag')
    options = [] if rviz else ['--no-rviz']
    if not image_hz:
        options += ['--devices', _DEVICES_WITHOUT_KINECT]
    try:
        arrived = _record(bag, topics, seconds, [*options, f'image_rate:={image_hz}'])
        recorded = _recorded_times(bag, topics)
        with running_cell(*options, '--mode', 'playback', '--bag', bag):
            played, velocity, dropped = _play(bag, topics)
    finally:
        Path(bag).unlink(missing_ok=True)
    begin_s = min(times[0] for times in recorded.values())
    published = {topic: window(stream, recorded[topic]).since(begin_s)
                 for topic, stream in arrived.items()}
    counted = {topic: Stream(stream.time_s[:len(recorded[topic])],
                             stream.values[:len(recorded[topic])])
               for topic, stream in played.items()}  # at the end the last messages may be repeated
    return ThesisRun(image_hz, published, {topic: times - begin_s
                                           for topic, times in recorded.items()},
                     counted, velocity, dropped)


def _record(bag: str, topics: Sequence[str], seconds: float, options: Sequence[str]
            ) -> Dict[str, Stream]:
    """Run and record the cell; return a subscriber's messages, at wall times."""
    folder, name = os.path.split(bag)
    with ArrivalRecorder(topics, f'{bag}.arrivals') as subscriber:
        with running_cell(*options):
            recorder = BagRecorder()  # of the cell
            recorder.wait_until_ready(_TIMEOUT_S)
            _wait_until_connected(subscriber, topics)
            time.sleep(_WARM_UP_S)
            recorder.start(RecordingOptions(tuple(topics), folder=folder, name=name))
            time.sleep(seconds)
            recorder.stop()
            recorder.close()
            wall_minus_monotonic_s = time.time() - time.monotonic()
        arrivals = subscriber.finish()  # it waits until no more messages arrive
    return {topic: stream.since(-wall_minus_monotonic_s)
            for topic, stream in streams(arrivals, topics).items()}


def _play(bag: str, topics: Sequence[str]) -> 'tuple[Dict[str, Stream], Stream, int]':
    """Play from the beginning to the end; return the arrivals, with times since play began."""
    player = PlayerClient()
    player.wait_until_ready(_TIMEOUT_S)
    player.pause()
    velocities: List[TwistStamped] = []
    listener = rospy.Subscriber(VELOCITY, TwistStamped, velocities.append)
    with ArrivalRecorder(topics, f'{bag}.arrivals') as subscriber:
        _wait_until_connected(subscriber, topics)
        time.sleep(_WARM_UP_S)
        player.seek(0.0)
        begin = subscriber.call('play')
        begin_wall_s = time.time() - (time.monotonic_ns() - begin.answer_ns) / 1e9
        _wait_for_the_end(player)
        arrivals = subscriber.finish()
    dropped = player.state.dropped if player.state is not None else 0
    listener.unregister()
    player.close()
    arrivals = arrivals[arrivals['time_ns'] >= begin.request_ns]  # without repeated messages
    begin_s = arrivals['time_ns'].min() / 1e9
    played = {topic: stream.since(begin_s)
              for topic, stream in streams(arrivals, topics).items()}
    length_s = max(stream.time_s[-1] for stream in played.values())
    velocity = window(_velocity(velocities).since(begin_wall_s), np.array([0.0, length_s]))
    return played, velocity, dropped


def _wait_for_the_end(player: PlayerClient) -> None:
    state = player.wait_for(lambda it: not it.paused, _TIMEOUT_S)
    if state is None or player.wait_for(lambda it: it.position >= it.duration - 1e-3,
                                        state.duration + _LATE_S) is None:
        raise RuntimeError('the player does not reach the end of the recording')


def _velocity(messages: Sequence[TwistStamped]) -> Stream:
    rows = np.array([[it.header.stamp.to_sec(), it.twist.linear.x, it.twist.linear.y,
                      it.twist.linear.z] for it in messages]).reshape(-1, 4)
    return Stream(rows[:, 0], rows[:, 1:])


def streams(arrivals: np.ndarray, topics: Sequence[str]) -> Dict[str, Stream]:
    """Return the arrivals by topic, at monotonic times; the numbers of tool frames and forces."""
    found = {}
    for number, topic in enumerate(topics):
        its = arrivals[arrivals['topic'] == number]
        has_numbers = topic.endswith(('/tcf', '/ft'))
        values = [float32_values(front[:size].tobytes()) if has_numbers else ()
                  for front, size in zip(its['front'], its['size'])]
        numbers = np.array(values) if values else np.zeros((0, 0))
        found[topic] = Stream(its['time_ns'] / 1e9, numbers)
    return found


def _recorded_times(bag: str, topics: Sequence[str]) -> Dict[str, np.ndarray]:
    """Return the times (n,) [s] of each topic in a bag."""
    with Recording([bag]) as recording:
        index = recording.index
        return {topic: index.time_ns[index.positions_of(index.connections_of(topic))] / 1e9
                for topic in topics}


def window(stream: Stream, times_s: np.ndarray) -> Stream:
    """Return the messages between the first and the last of times (n,) [s], both included.

    A message reaches two subscribers at different times, at most ``_EDGE_S`` apart.
    """
    inside = ((stream.time_s >= times_s[0] - _EDGE_S) & (stream.time_s <= times_s[-1] + _EDGE_S))
    return Stream(stream.time_s[inside], stream.values[inside])


def _wait_until_connected(subscriber: ArrivalRecorder, topics: Sequence[str]) -> None:
    end_s = time.monotonic() + _TIMEOUT_S
    while subscriber.connected() < len(topics):
        if time.monotonic() > end_s:
            raise RuntimeError(f'{subscriber.connected()} of {len(topics)} topics are published')
        time.sleep(0.1)
