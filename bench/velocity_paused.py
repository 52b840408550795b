# SPDX-License-Identifier: BSD-3-Clause
"""Measures velocities at positions where playback is paused, reached in several ways."""
from __future__ import annotations

import time
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Tuple

import numpy as np
import rosbag
import rospy
from geometry_msgs.msg import TwistStamped
from std_srvs.srv import Trigger
from velocity_truth import ROBOT, Truth
from visualization_msgs.msg import MarkerArray

from process_visualizer.msg import PlayerState
from process_visualizer.robot.measuring_time import measuring_times
from process_visualizer.robot.recorded_velocity import speeds
from process_visualizer.srv import Seek, SetRate, Step

POSE, VELOCITY, MARKERS = (f'/{ROBOT}/{name}' for name in ('tcf', 'tool_velocity', 'marker_array'))
STATE = '/bag_player/state'
WITHIN_S = 0.1  # of the answer to the command
PLAYED_S = 0.25
TIMEOUT_S = 20.0


class Standing(NamedTuple):
    """The display WITHIN_S after a command that ended at a position [s of the recording].

    The velocity that was published (3,) [m/s] and the time [s] from the command to its first
    arrival, and the number in RViz [m/s]; None where there is none.
    """

    position_s: float
    velocity: Optional[np.ndarray]
    delay_s: float
    number: Optional[float]


class Watch:
    """The arriving velocities with their times, and the player's states."""

    def __init__(self) -> None:
        self._velocities: List[Tuple[float, np.ndarray]] = []
        self._texts: List[str] = ['']
        self._states: List[PlayerState] = []
        rospy.Subscriber(VELOCITY, TwistStamped, self._on_velocity, tcp_nodelay=True)
        rospy.Subscriber(MARKERS, MarkerArray, self._on_markers, tcp_nodelay=True)
        rospy.Subscriber(STATE, PlayerState, self._states.append, tcp_nodelay=True)

    def after(self, name: str, service: type, *request: Any) -> Standing:
        """Give a command after which the player is paused, and read the display."""
        self._velocities.clear()
        begin_s = time.monotonic()
        command(name, service, *request)
        answered, answered_s = rospy.Time.now(), time.monotonic()
        time.sleep(WITHIN_S)
        velocities, text = list(self._velocities), self._texts[-1]
        velocity = velocities[-1][1] if velocities else None
        first_s = next((at_s for at_s, it in velocities if (it == velocity).all()), answered_s)
        number = float(text.split()[1]) if text.endswith(' m/s') else None
        return Standing(self._position_s(answered), velocity, first_s - begin_s, number)

    def _position_s(self, since: rospy.Time) -> float:
        end_s = time.monotonic() + TIMEOUT_S
        while not (self._states and self._states[-1].stamp >= since):
            if time.monotonic() > end_s:
                raise RuntimeError('the player says nothing')
            time.sleep(0.01)
        state = self._states[-1]
        return float(state.position + state.begin.to_sec())

    def _on_velocity(self, message: TwistStamped) -> None:
        linear = message.twist.linear
        self._velocities.append((time.monotonic(), np.array([linear.x, linear.y, linear.z])))

    def _on_markers(self, message: MarkerArray) -> None:
        self._texts += [marker.text.strip() for marker in message.markers
                        if (marker.ns, marker.id) == ('velocity', 1)]


def command(name: str, service: type, *request: Any) -> None:
    """Call a service of the player; raise RuntimeError if it refuses."""
    answer = rospy.ServiceProxy(f'/bag_player/{name}', service)(*request)
    if not answer.success:
        raise RuntimeError(f'/bag_player/{name}: {answer.message}')


def standings(count: int) -> Dict[str, List[Standing]]:
    """Return the display at a number of positions, reached in each way."""
    watch = Watch()
    duration_s = rospy.wait_for_message(STATE, PlayerState, TIMEOUT_S).duration
    positions_s = np.random.default_rng(4).uniform(0.5, duration_s - 0.5, count).tolist()
    command('pause', Trigger)
    found = {'seek': [watch.after('seek', Seek, position_s) for position_s in positions_s],
             'step': list(_steps(watch, positions_s))}
    for rate in (1.0, -1.0):
        found[f'pause at {rate:g}x'] = list(_pauses(watch, rate, positions_s[::2]))
    return found


def _steps(watch: Watch, positions_s: List[float]) -> Iterator[Standing]:
    for number, position_s in enumerate(positions_s):
        if number % 20 == 0:
            watch.after('seek', Seek, position_s)
        yield watch.after('step', Step, 1 if number % 40 < 20 else -1, POSE, 0.0)


def _pauses(watch: Watch, rate: float, positions_s: List[float]) -> Iterator[Standing]:
    command('set_rate', SetRate, rate)
    for position_s in positions_s:
        command('seek', Seek, position_s - rate * PLAYED_S)
        command('play', Trigger)
        time.sleep(PLAYED_S)
        yield watch.after('pause', Trigger)


def curve_of(bag: str) -> Callable[[float], float]:
    """Return the speed [m/s] that the timeline's curve has at a time of the recording [s]."""
    arrival_s, positions = [], []
    with rosbag.Bag(bag) as file:
        for _, message, stamp in file.read_messages(topics=[POSE]):
            arrival_s.append(stamp.to_sec())
            positions.append(message.data[:3])
    begin_s = arrival_s[0]
    times_s = measuring_times(np.array(arrival_s) - begin_s, np.full(len(arrival_s), np.nan))
    middle_s, speed = speeds(times_s, np.array(positions))
    return lambda time_s: float(np.interp(time_s - begin_s, middle_s, speed))


class Comparison(NamedTuple):
    """The reference for velocities at positions; the simulation began at ``begin_s``.

    ``played`` returns the velocities (n, 3) [m/s] shown at times of the simulation (n,)
    [s] when it was played at 1x. Errors are shares of the largest speed.
    """

    truth: Truth
    begin_s: float
    peak_m_per_s: float
    played: Callable[[np.ndarray], np.ndarray]

    def errors(self, times_s: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Errors (n,) [%] of velocities (n, 3) [m/s] at times of the simulation (n,) [s]."""
        errors: np.ndarray = np.linalg.norm(values - self.truth.velocity(times_s), axis=1)
        return errors / self.peak_m_per_s * 100


def report(found: Dict[str, List[Standing]], bag: str, comparison: Comparison) -> None:
    """Print a row for each way to reach a position."""
    curve = curve_of(bag)
    print(f'\n| paused after | positions | none after {WITHIN_S:g} s | RMS, % | '
          'at 1x there: RMS, % | largest, % | another number in RViz | from the curve: largest, '
          'mm/s | after the command: median, ms | largest, ms |\n' + '|---' * 10 + '|')
    for name, rows in found.items():
        print(f'| {name} | {len(rows)} | {_row(rows, curve, comparison)} |',
              flush=True)


def _row(rows: List[Standing], curve: Callable[[float], float], comparison: Comparison) -> str:
    known = [row for row in rows if row.velocity is not None]
    times_s = np.array([row.position_s for row in known])
    values = np.array([row.velocity for row in known])
    simulated_s = times_s - comparison.begin_s
    error = comparison.errors(simulated_s, values)
    played = comparison.errors(simulated_s, comparison.played(simulated_s))
    speed = np.linalg.norm(values, axis=1)
    others = sum(row.number is None or abs(row.number - it) > 0.00051
                 for row, it in zip(known, speed))
    from_curve = np.abs(speed - [curve(time_s) for time_s in times_s]).max() * 1e3
    delays_ms = [1e3 * row.delay_s for row in known]
    return (f'{len(rows) - len(known)} | {_rms(error):.2f} | {_rms(played):.2f} | '
            f'{error.max():.1f} | {others} | {from_curve:.2f} | {np.median(delays_ms):.0f} | '
            f'{max(delays_ms):.0f}')


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt((values ** 2).mean()))
