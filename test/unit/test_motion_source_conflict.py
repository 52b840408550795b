# SPDX-License-Identifier: BSD-3-Clause
"""A driver and a forgotten node on the same topic."""
from __future__ import annotations

import math

from process_visualizer.nodes.robot.message_reader import SourceConflict


def test_a_forgotten_node_is_named() -> None:
    conflict = SourceConflict(0.02)
    said = [conflict.add(*told) for number in range(10) for told in (
        ('/driver', (0.5, 0.001 * number, 0.2), 0.01 * number),
        ('/simulator', (0.0, 0.0, 0.0), 0.01 * number + 0.005))]
    assert said[0] == ''
    assert '2 nodes publish on this topic, /driver, /simulator, and their values are' in said[-1]
    assert conflict.add('/driver', (0.5, 0.01, 0.2), 5.0) == ''  # the other one has ended


def test_one_node_and_one_that_passes_its_values_on_agree() -> None:
    conflict = SourceConflict(0.02)
    for number in range(1000):
        place = [(math.sin(0.02 * it), 0.0, 0.0) for it in (number, max(0, number - 8))]
        assert conflict.add('/driver', place[0], 0.01 * number) == ''
        assert conflict.add('/relay', place[1], 0.01 * number) == ''


def test_a_node_alone_may_jump() -> None:
    conflict = SourceConflict(0.02)
    assert not any(conflict.add('/driver', (float(number % 2),), 0.01 * number)
                   for number in range(100))
