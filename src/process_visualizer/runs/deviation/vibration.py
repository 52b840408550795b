# SPDX-License-Identifier: BSD-3-Clause
"""The frequency at which something vibrates."""
from __future__ import annotations

from typing import Optional

import numpy as np

from process_visualizer.runs.data_gaps import period_s
from process_visualizer.runs.run import Channel

_BEFORE_S, _FEWEST = 0.5, 32
_LEAST_HZ, _PERIODS = 2.0, 4.0
_PEAK = 12.0
"""Of white noise, one of some hundred frequencies has seldom so many times the usual power."""


def vibration_hz(channel: Channel, begin_s: float, end_s: float) -> Optional[float]:
    """Return the frequency [Hz] of a vibration between two times of a run [s]; None without one.

    It is that of the highest peak of the power over frequencies, if that is clearly one.
    """
    usual_s = period_s(channel.times_s)
    inside = np.isfinite(channel.values) & (channel.times_s >= begin_s - _BEFORE_S) \
        & (channel.times_s <= end_s)
    if usual_s <= 0.0 or np.count_nonzero(inside) < _FEWEST:
        return None
    known_s, values = channel.times_s[inside], channel.values[inside].astype(float)
    times_s = np.arange(known_s[0], known_s[-1], usual_s)
    even = np.interp(times_s, known_s, values)
    rows = np.arange(len(even))
    even -= np.polyval(np.polyfit(rows, even, 1), rows)
    power = np.square(np.abs(np.fft.rfft(even * np.hanning(len(even)))))
    hz = np.fft.rfftfreq(len(even), usual_s)
    tells = hz >= max(_LEAST_HZ, _PERIODS / (len(even) * usual_s))
    if np.count_nonzero(tells) < 8:
        return None
    peak = int(np.where(tells, power, 0.0).argmax())
    if power[peak] < _PEAK * float(np.median(power[tells])) / np.log(2.0):
        return None
    return float(hz[peak])
