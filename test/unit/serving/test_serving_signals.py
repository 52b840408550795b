# SPDX-License-Identifier: BSD-3-Clause
"""A page ends with its terminal, so that its node does not stay registered."""
from __future__ import annotations

import os
import signal
from typing import Iterator, List

import pytest

from process_visualizer.commands.viewer_commands import stop_at_signals

SIGNALS = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


@pytest.fixture(autouse=True)
def restored() -> Iterator[None]:
    """Restores the signal handlers of the tests."""
    before = {it: signal.getsignal(it) for it in SIGNALS}
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize('number', SIGNALS)
def test_each_of_them_ends_it(number: signal.Signals) -> None:
    calls: List[int] = []
    stop_at_signals(lambda: calls.append(1))
    os.kill(os.getpid(), number)
    assert calls == [1]


def test_nohup_is_respected() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    stop_at_signals(lambda: pytest.fail('it is called'))
    os.kill(os.getpid(), signal.SIGHUP)
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
