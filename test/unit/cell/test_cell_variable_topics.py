# SPDX-License-Identifier: BSD-3-Clause
"""The topics of variables are recorded and played without a <topic> of their own."""
from __future__ import annotations

from typing import Callable, List, Tuple

from process_visualizer.cell.model import Cell
from process_visualizer.cell.outputs import outputs

VARIABLE = '<variable topic="{}" frame="oven"/>'
Parse = Callable[..., Cell]


def topics(parse: Parse, *devices: str) -> List[Tuple[str, bool]]:
    """The topics of all devices, and whether they are recorded."""
    cell = parse(f'<visualizer>{"".join(devices)}</visualizer>')
    return [(topic.name, topic.record) for device in cell.devices for topic in device.topics]


def oven(*elements: str) -> str:
    return f'<device type="other" name="oven">{"".join(elements)}</device>'


def test_the_topic_of_a_variable(parse: Parse) -> None:
    assert topics(parse, oven(VARIABLE.format('heat'))) == [('/heat', True)]


def test_the_topic_of_a_variable_that_is_not_shown(parse: Parse) -> None:
    hidden = VARIABLE.format('heat').replace('/>', ' shown="False"/>')
    assert topics(parse, oven(hidden)) == [('/heat', True)]
    assert outputs(parse(f'<visualizer>{oven(hidden)}</visualizer>').devices) == {}


def test_two_variables_of_one_topic(parse: Parse) -> None:
    assert topics(parse, oven(VARIABLE.format('heat'), VARIABLE.format('/heat'))) == [
        ('/heat', True)]


def test_a_topic_says_whether_it_is_recorded(parse: Parse) -> None:
    assert topics(parse, oven(VARIABLE.format('heat'), '<topic name="heat" record="False"/>')) == [
        ('/heat', False)]


def test_a_topic_of_another_device(parse: Parse) -> None:
    robot = '<device type="robot" name="arm"><topic name="ft" type="force_sensor"/></device>'
    assert topics(parse, oven(VARIABLE.format('ft')), robot) == [('/ft', True)]


def test_what_the_program_publishes_is_not_recorded(parse: Parse) -> None:
    robot = '<device type="robot" name="arm"/>'
    assert topics(parse, oven(VARIABLE.format('arm/tool_velocity')), robot) == []
