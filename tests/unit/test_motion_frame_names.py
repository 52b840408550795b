"""Which link a driver means that knows neither the prefix nor the namespace of the model."""
import pytest

from process_visualizer.motion.frame_names import meant_frame


@pytest.mark.parametrize(('name', 'links', 'prefix', 'expected'), [
    ('base', ['base_link', 'base'], '', 'base'),
    ('/base', ['base_link', 'base'], '', 'base'),
    ('base', ['left_base_link', 'left_base'], 'left_', 'left_base'),
    ('left_base', ['left_base_link', 'left_base'], 'left_', 'left_base'),
    ('left/base', ['left_base_link', 'left_base'], 'left_', 'left_base'),
    ('left/base', ['base_link', 'base'], '', 'base'),  # a tf prefix that the model lacks
    ('/left/base', ['base_link', 'base'], '', 'base'),
    ('base', ['left/base_link', 'left/base'], '', 'left/base'),
    ('base', ['left/base_link', 'left/base'], 'left/', 'left/base'),
    ('right/base', ['base_link', 'base'], '', 'right/base'),  # that of another robot
    ('world', ['base_link', 'base'], 'left_', 'world'),
    ('', ['base_link'], '', ''),
])
def test_name(name: str, links: 'list[str]', prefix: str, expected: str) -> None:
    assert meant_frame(name, links, 'left', prefix) == expected
