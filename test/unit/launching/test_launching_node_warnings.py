# SPDX-License-Identifier: BSD-3-Clause
"""Warnings of nodes: counted, one per subject, removed when they no longer hold."""
from __future__ import annotations

import io
import socket
from typing import List, Tuple

import pytest
from rosgraph.network import ROSHandshakeException, read_ros_handshake_header

from process_visualizer.health.node_warnings import (
    LOG_S,
    STATE_S,
    NodeWarnings,
    Severity,
    by_node,
    counted,
)

NODE = '/arm/driver'
WARNING, ERROR = Severity.WARNING, Severity.ERROR


def shown(warnings: NodeWarnings, now_s: float) -> List[Tuple[str, str, int]]:
    return [(it.node, it.text, it.count) for it in warnings.present(now_s)]


def test_lines_that_differ_in_numbers_only_are_one() -> None:
    warnings = NodeWarnings()
    for number in range(100):
        warnings.take_log(NODE, WARNING, f'no answer for 0.{number:02} s', 1.0 + number / 100)
    warnings.take_log(NODE, ERROR, 'the emergency stop is pressed', 2.0)
    assert shown(warnings, 2.0) == [(NODE, 'the emergency stop is pressed', 1),
                                    (NODE, 'no answer for 0.99 s', 100)]
    assert counted(warnings.present(2.0)) == '1 error, 1 warning'


def test_a_subscriber_that_leaves_while_it_connects_is_no_warning() -> None:
    here, there = socket.socketpair()
    there.close()
    with here, pytest.raises(ROSHandshakeException) as said:
        read_ros_handshake_header(here, io.BytesIO(), 1024)
    warnings = NodeWarnings()
    warnings.take_log(NODE, WARNING, f'Inbound TCP/IP connection failed: {said.value}', 1.0)
    assert shown(warnings, 1.0) == []


def test_a_line_that_is_not_repeated_goes() -> None:
    warnings = NodeWarnings()
    warnings.take_log(NODE, WARNING, 'late', 1.0)
    warnings.take_log(NODE, WARNING, 'late', 10.0)
    assert shown(warnings, 10.0 + LOG_S) == [(NODE, 'late', 2)]
    assert shown(warnings, 10.1 + LOG_S) == []
    warnings.take_log(NODE, WARNING, 'late', 50.0)
    assert shown(warnings, 50.0) == [(NODE, 'late', 1)]


def test_a_state_goes_at_once_when_all_is_well_and_soon_when_its_node_is_gone() -> None:
    warnings = NodeWarnings()
    values = {'messages': '125', 'for_s': '2.5'}
    warnings.take_state(NODE, 'pose', WARNING, 'left out', 10.0, values)
    [found] = warnings.present(10.1)
    assert (found.count, found.since_s) == (125, 7.5)
    assert shown(warnings, 10.1 + STATE_S) == []
    warnings.take_state(NODE, 'pose', WARNING, 'left out', 20.0, values)
    warnings.take_state(NODE, 'pose', None, 'all is well', 20.5, {})
    assert shown(warnings, 20.5) == []


def test_somebody_elses_values_need_not_be_numbers() -> None:
    warnings = NodeWarnings()
    for now_s, text in enumerate(('many', 'nan', '-inf')):
        values = {'messages': text, 'for_s': text}
        warnings.take_state(NODE, 'heat', ERROR, 'too hot', now_s, values)
        assert shown(warnings, now_s) == [(NODE, 'too hot', 0)]


def test_a_state_without_a_duration_is_as_old_as_it_is_known() -> None:
    warnings = NodeWarnings()
    warnings.take_state(NODE, 'heat', ERROR, 'too hot', 1.0, {})
    warnings.take_state(NODE, 'heat', ERROR, 'too hot', 2.0, {})
    assert [it.since_s for it in warnings.present(2.0)] == [1.0]


def test_what_stands_in_the_log_too_is_one() -> None:
    """Either of them may come first."""
    warnings = NodeWarnings()
    warnings.take_log(NODE, WARNING, 'arm: left out: a', 1.0)
    warnings.take_state(NODE, 'pose', WARNING, 'left out: a', 1.1, {})
    warnings.take_state(NODE, 'pose', WARNING, 'left out: b', 2.0, {})
    warnings.take_log(NODE, WARNING, 'arm: left out: b', 2.1)
    warnings.take_log(NODE, WARNING, 'arm: left out: a', 2.2)
    assert shown(warnings, 2.2) == [(NODE, 'left out: b', 0)]


def test_a_node_that_always_says_something_else_is_bounded() -> None:
    warnings = NodeWarnings()
    for number in range(500):
        warnings.take_log(NODE, WARNING, f'{"x" * number} failed', 1.0 + number / 1000)
    assert len(warnings.present(1.5)) <= 20


def test_those_of_a_device() -> None:
    warnings = NodeWarnings()
    warnings.take_log(NODE, WARNING, 'late', 1.0)
    warnings.take_log('/bag_player', WARNING, 'a recorded line', 1.0)
    assert [it.text for it in by_node(warnings.present(1.0), {NODE})] == ['late']
    warnings.forget()
    assert warnings.present(1.0) == ()
