# SPDX-License-Identifier: BSD-3-Clause
"""Frame names from drivers that know neither the prefix nor the namespace of the model."""
import pytest

from process_visualizer.robot.frames import meant_frame, prefix_advice


@pytest.mark.parametrize(('name', 'links', 'prefix', 'expected'), [
    ('base', ['base_link', 'base'], '', 'base'),
    ('/base', ['base_link', 'base'], '', 'base'),
    ('base', ['left_base_link', 'left_base'], 'left_', 'left_base'),
    ('left_base', ['left_base_link', 'left_base'], 'left_', 'left_base'),
    ('left/base', ['left_base_link', 'left_base'], 'left_', 'left_base'),
    ('left/base', ['base_link', 'base'], '', 'base'),  # a tf prefix that the model does not have
    ('/left/base', ['base_link', 'base'], '', 'base'),
    ('base', ['left/base_link', 'left/base'], '', 'left/base'),
    ('base', ['left/base_link', 'left/base'], 'left/', 'left/base'),
    ('right/base', ['base_link', 'base'], '', 'right/base'),  # the prefix of another robot
    ('world', ['base_link', 'base'], 'left_', 'world'),
    ('', ['base_link'], '', ''),
])
def test_name(name: str, links: 'list[str]', prefix: str, expected: str) -> None:
    assert meant_frame(name, links, 'left', prefix) == expected


@pytest.mark.parametrize(('name', 'links', 'parts'), [
    ('left_link8', ['base', 'link8'], ['left_link8 link8', 'prefix="left_"', '<base>']),
    ('l/link8', ['link8'], ['prefix="l/"']),
    ('link8', ['left_base', 'left_link8'], ['link8 left_link8', 'prefix="left_"', '<arg>']),
    ('leftlink8', ['link8'], []), ('link8', ['link8'], []), ('flange', ['link8'], [])])
def test_advice_about_a_prefix(name: str, links: 'list[str]', parts: 'list[str]') -> None:
    advice = prefix_advice(name, links)
    assert bool(advice) == bool(parts) and all(part in advice for part in parts)
