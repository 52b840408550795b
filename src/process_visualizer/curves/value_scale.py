# SPDX-License-Identifier: BSD-3-Clause
"""The scale of a curve: bounds and ticks that are round numbers and rarely change."""
from __future__ import annotations

import math
from typing import Iterator, NamedTuple, Optional, Sequence, Tuple

MAX_TICKS = 3
_FAR_FROM_ZERO = 0.6  # share of the farthest value: if all values are beyond it, zero is not shown
_KEPT_SHARE = 0.3  # share of the old scale: the scale stays while the values need this much of it
_NEAR_SHARE = 0.5  # share of the values' span: a limit within this distance is shown, too
_ROOM = 1.2  # end of the scale of a constant value, as a multiple of it: off the edge
_MAX_VALUE, _MIN_VALUE = 1e300, 1e-290  # numbers beyond these are not measurements
_RESOLUTION = 1e-9  # share of the largest value: the shortest span that can be represented
_MAX_NUMBER = 5  # digits before or after the point; longer numbers have an exponent


class ValueScale(NamedTuple):
    """The values at the bottom and the top of a curve, and those of its labeled ticks.

    ``step`` is the distance between two ticks: 1, 2 or 5 times a power of ten.
    """

    low: float
    high: float
    ticks: Tuple[float, ...]
    step: float

    @property
    def span(self) -> float:
        """The difference between top and bottom."""
        return self.high - self.low


EMPTY_SCALE = ValueScale(0.0, 1.0, (0.0, 1.0), 1.0)
"""The scale of a curve without values."""


class _Step(NamedTuple):
    """``digit`` times ten to the power of ``exponent``."""

    digit: int
    exponent: int

    def times(self, count: float) -> float:
        """Return a multiple, rounded only once: 3 times 0.1 is 0.3."""
        number = count * self.digit
        return number * 10.0 ** self.exponent if self.exponent >= 0 \
            else number / 10.0 ** -self.exponent


def tidy_scale(low: float, high: float, least_span: float = 0.0,
               before: Optional[ValueScale] = None) -> ValueScale:
    """Return a scale for values from low to high; NaN: there are no values.

    The scale includes zero unless all values are far from it. A single value is shown above (or
    below) zero.

    Args:
        low: the smallest value shown.
        high: the largest value shown.
        least_span: a smaller variation does not fill the scale.
        before: the current scale, which stays while the values are in it and need much of it.
    """
    if not (math.isfinite(low) and math.isfinite(high)):
        return before or EMPTY_SCALE
    fresh = _tidied(*_widened(*_with_zero(_limited(low), _limited(high)), least_span))
    if before is not None and before.low <= low and high <= before.high \
            and fresh.span >= _KEPT_SHARE * before.span:
        return before
    return fresh


def with_near_limits(low: float, high: float,
                     limits: Sequence[float]) -> Tuple[float, float]:
    """Return the ends of a range of values, extended to nearby limits."""
    reach = _NEAR_SHARE * (high - low)
    near = [limit for limit in limits if low - reach <= limit <= high + reach]
    return min([low, *near]), max([high, *near])


def tick_texts(scale: ValueScale) -> Tuple[str, ...]:
    """Return the ticks as text, with the decimals needed to distinguish them."""
    largest = max(abs(tick) for tick in scale.ticks)
    exponent = math.floor(math.log10(scale.step) + 1e-9)
    top = math.floor(math.log10(largest) + 1e-9) if largest else 0
    if max(top, -exponent) >= _MAX_NUMBER:
        return tuple(_with_exponent(tick, exponent) for tick in scale.ticks)
    return tuple(f'{tick:.{max(-exponent, 0)}f}'.replace('-', '−') for tick in scale.ticks)


def _with_exponent(tick: float, exponent: int) -> str:
    if not tick:
        return '0'
    digits = max(math.floor(math.log10(abs(tick)) + 1e-9) - exponent, 0)
    number, power = f'{tick:.{digits}e}'.split('e')
    return f'{number}e{int(power)}'.replace('-', '−')


def _limited(value: float) -> float:
    return min(max(value, -_MAX_VALUE), _MAX_VALUE) if abs(value) >= _MIN_VALUE else 0.0


def _with_zero(low: float, high: float) -> Tuple[float, float]:
    if low == high:
        return (min(_ROOM * low, 0.0), max(_ROOM * high, 0.0)) if low else (0.0, 1.0)
    if 0.0 < low < _FAR_FROM_ZERO * high:
        return 0.0, high
    if 0.0 > high > _FAR_FROM_ZERO * low:
        return low, 0.0
    return low, high


def _widened(low: float, high: float, least_span: float) -> Tuple[float, float]:
    """Return the ends, moved apart until the numbers differ and the difference is visible."""
    lacking = max(least_span, _RESOLUTION * max(abs(low), abs(high))) - (high - low)
    return (low - lacking / 2, high + lacking / 2) if lacking > 0.0 else (low, high)


def _tidied(low: float, high: float) -> ValueScale:
    """Return the finest scale with few enough ticks; its ends are at a tick or between two."""
    for step in _steps(high - low):
        size = step.times(1)
        begin, end = math.floor(2.0 * (low / size)), math.ceil(2.0 * (high / size))
        if end - begin == 2 and end % 2:
            end += 1  # else the only tick would be in the middle
        counts = range(-(-begin // 2), end // 2 + 1)
        if len(counts) <= MAX_TICKS:
            break
    return ValueScale(step.times(begin / 2), step.times(end / 2),
                      tuple(step.times(count) for count in counts), size)


def _steps(span: float) -> Iterator[_Step]:
    """Return the candidate steps, ascending."""
    exponent = math.floor(math.log10(span))
    return (_Step(digit, power) for power in (exponent - 1, exponent, exponent + 1)
            for digit in (1, 2, 5))
