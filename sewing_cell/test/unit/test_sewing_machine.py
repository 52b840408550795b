# SPDX-License-Identifier: BSD-3-Clause
"""What the sewing machine's sensors mean in the needle frame."""

from __future__ import annotations

import numpy as np
import pytest

from process_visualizer.motion.rotations import matrix_from_ypr
from process_visualizer.parameters.reading import ParameterError, Parameters
from sewing_cell.sewing_machine import (
    FEED_DIRECTION,
    UPPER_ARROW,
    SewingParameters,
    edge_text,
    edge_vector,
)

NEEDLE_IN_WORLD = matrix_from_ypr((np.pi / 2, 0.0, 0.0))


def test_feed_is_world_minus_y():
    assert np.allclose(NEEDLE_IN_WORLD @ FEED_DIRECTION, [0, -1, 0])


@pytest.mark.parametrize('value, setpoint, expected', [
    (265.0, 255.0, [-10, 0, 0]),  # too far right as seen along the feed
    (245.0, 255.0, [10, 0, 0]),
    (255.0, 255.0, [0, 0, 0]),
])
def test_edge_points_to_where_the_workpiece_is(value, setpoint, expected):
    assert np.allclose(NEEDLE_IN_WORLD @ edge_vector(value, setpoint), expected)


def test_edge_text_has_value_and_distance():
    assert edge_text(UPPER_ARROW, 263.0, 255.0, 0.1, 1.0) == 'upper edge 263, 8 above 255'
    assert edge_text(UPPER_ARROW, 249.0, 255.0, 0.1, 1.0) == 'upper edge 249, 6 below 255'
    assert edge_text(UPPER_ARROW, 249.0, 255.0, 3.2, 1.0) == 'upper edge no data for 3.2 s'


def test_parameters():
    parameters = SewingParameters.read(Parameters(
        {'mesh': '', 'base_frame': '/m/base', 'arrows': {'edge_upper': {'scale': 0.01}}}, '/s'))
    assert (parameters.mesh, parameters.base_frame) == ('', 'm/base')
    assert parameters.upper_arrow.scale_m == 0.01
    with pytest.raises(ParameterError, match='/s/text/position'):
        SewingParameters.read(Parameters({'text': {'position': [1, 2]}}, '/s'))
