# SPDX-License-Identifier: BSD-3-Clause
"""Signals to the command that runs a cell."""
from __future__ import annotations

import signal

import pytest

from process_visualizer.commands.run_command import StopRequested, raise_stop_once


@pytest.mark.parametrize('second', [signal.SIGINT, signal.SIGTERM])
def test_a_second_signal_does_not_interrupt_the_end(second: signal.Signals) -> None:
    before = {number: signal.signal(number, raise_stop_once)
              for number in (signal.SIGINT, signal.SIGTERM)}
    hang_up = signal.getsignal(signal.SIGHUP)
    try:
        with pytest.raises(StopRequested):
            signal.raise_signal(signal.SIGINT)
        signal.raise_signal(second)
    finally:
        for number, handler in {**before, signal.SIGHUP: hang_up}.items():
            signal.signal(number, handler)
