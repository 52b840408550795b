# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of topics that may be process variables, and how to draw them."""
from __future__ import annotations

import math
import re
from typing import Dict, List, NamedTuple, Optional, Sequence

from process_visualizer.discovery.evidence.seen import SeenNumber, SeenTopic
from process_visualizer.discovery.names import is_field

MOST_PER_TOPIC = 6
"""Arrows for one topic; more would hide each other."""
_LENGTH_M = 0.3
"""Of the longest arrow for the values that were seen."""
_MOST_M = 0.6
"""Of an arrow for whatever comes later."""
_MOMENT_SHARE = 0.2
"""A number that was seen for a moment will change by this share of it at least."""
_COLORS = ('orange', 'cyan', 'yellow', 'purple', 'blue', 'red', 'white')
_KNOWN: Dict[str, Dict[str, str]] = {
    'sensor_msgs/Temperature': {'temperature': '°C'},
    'sensor_msgs/Range': {'range': 'm'},
    'sensor_msgs/FluidPressure': {'fluid_pressure': 'Pa'},
    'sensor_msgs/Illuminance': {'illuminance': 'lx'},
    'sensor_msgs/RelativeHumidity': {'relative_humidity': ''},
    'sensor_msgs/BatteryState': {'voltage': 'V', 'current': 'A'},
}
"""What these messages measure, and its unit by the message's definition."""
_NO_VARIABLES = frozenset({
    'sensor_msgs', 'geometry_msgs', 'nav_msgs', 'tf', 'tf2_msgs', 'visualization_msgs',
    'trajectory_msgs', 'shape_msgs', 'stereo_msgs', 'actionlib_msgs', 'moveit_msgs'})
_NO_MEASUREMENT = re.compile(
    r'(.*_)?(seq|sequence|stamp|secs|nsecs|id|count|counter|index|number|mode|state|status|code|'
    r'error|flags?|version|width|height|size|step|covariance|variance|timestamp)')


class Candidate(NamedTuple):
    """A number that may be a variable: the attributes of its <variable> but topic and frame.

    It is ``likely`` one if it changed, or its message is that of a sensor.
    """

    attributes: Dict[str, str]
    likely: bool


def candidates(topic: SeenTopic, begin: int = 0, is_moment: bool = False) -> List[Candidate]:
    """Return the candidates of a topic; colours count on from ``begin``.

    ``is_moment`` as in ``Seen``.
    """
    known = _KNOWN.get(topic.type)
    numbers = [it for it in topic.numbers if _is_measured(it, topic, known)]
    return [Candidate(_attributes(topic, number, (known or {}).get(number.path, ''), begin + i,
                                  len(numbers) > 1, is_moment),
                      number.changes or known is not None)
            for i, number in enumerate(numbers[:MOST_PER_TOPIC])]


def left_out(topic: SeenTopic) -> int:
    """Return how many more numbers a topic has that may be variables."""
    known = _KNOWN.get(topic.type)
    return max(0, sum(_is_measured(it, topic, known) for it in topic.numbers) - MOST_PER_TOPIC)


def _is_measured(number: SeenNumber, topic: SeenTopic, known: Optional[Dict[str, str]]) -> bool:
    if not is_field(number.path):
        return False
    if known is not None:
        return number.path in known
    if topic.type.partition('/')[0] in _NO_VARIABLES:
        return False
    name = number.path.rpartition('.')[2]
    return not number.is_counter and not _NO_MEASUREMENT.fullmatch(name)


def _attributes(topic: SeenTopic, number: SeenNumber, unit: str, color: int,
                is_one_of_many: bool, is_moment: bool) -> Dict[str, str]:
    offset, scale = scaling(number.low, number.high, _MOMENT_SHARE if is_moment else 0.0)
    name = topic.name.rpartition('/')[2]
    attributes = {'axis': 'z', 'label': f'{name} {number.path}' if is_one_of_many else name}
    if number.path != 'data':
        attributes['field'] = number.path
    if unit:
        attributes['unit'] = unit
    attributes.update(scale=f'{scale:g}', max=f'{_MOST_M:g}')
    if offset:
        attributes['offset'] = f'{offset:g}'
    attributes['color'] = _COLORS[color % len(_COLORS)]
    return attributes


def scaling(low: float, high: float, least_share: float = 0.0) -> Sequence[float]:
    """Return offset and scale [m per unit] that make arrows of 0.3 m or less of these values.

    Values will be spread over this share of the largest at least.
    """
    largest = max(abs(low), abs(high))
    spread = max(high - low, least_share * largest)
    if not math.isfinite(spread) or largest == 0.0 or not math.isfinite(1.0 / largest):
        return 0.0, 1.0
    if spread < 0.5 * largest and spread > 1e-6 * largest and low * high > 0.0:
        offset = _rounded(low, spread)
        return offset, _one_digit(_LENGTH_M / max(abs(high - offset), abs(low - offset), spread))
    return 0.0, _one_digit(_LENGTH_M / largest)


def _rounded(value: float, spread: float) -> float:
    """The value to the decimal place of what it is spread over."""
    step = 10.0 ** math.floor(math.log10(spread))
    return math.floor(value / step) * step


def _one_digit(value: float) -> float:
    return float(f'{value:.0e}')
