# SPDX-License-Identifier: BSD-3-Clause
"""The sewing machine's sensors in the needle frame, and their display by its node."""

from __future__ import annotations

from typing import Any, Dict, Sequence, Tuple

import numpy as np
import pytest
from simulated_node import SimulatedNode
from std_msgs.msg import Float32, UInt16
from visualization_msgs.msg import Marker

from process_visualizer.msg import PlayerState
from process_visualizer.parameters.reading import ParameterError, Parameters
from process_visualizer.robot.rotations import matrix_from_ypr
from process_visualizer.ros_names import PLAYER_STATE_TOPIC
from sewing_cell.sewing_machine import (
    FEED_DIRECTION,
    UPPER_ARROW,
    SewingParameters,
    SewingTransformer,
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


class Machine:
    """The node, and its markers as RViz would have them."""

    def __init__(self, **parameters: Any) -> None:
        self.node = SimulatedNode('/sewing_machine/sewing_machine',
                                  {'/sewing_machine/setpoint_upper': 300})
        SewingTransformer(self.node, SewingParameters.read(Parameters(parameters, '/s')))
        self._markers: Dict[Tuple[str, int], Marker] = {}
        self.recording, self.since = '', self.node.now()

    def send(self, feed: float = 0.0625) -> None:
        """Publish one value of each sensor."""
        for topic, message in (('/edge_finder_upper', UInt16(310)),
                               ('/edge_finder_lower', UInt16(225)),
                               ('/feed_rate_est', Float32(feed))):
            self.node.send(topic, message)

    def play(self, recording: str, duration_s: float, not_begun: Sequence[str] = ()) -> None:
        """Let a player pause in a recording for some time; another recording is a new player."""
        self.since = self.since if recording == self.recording else self.node.now()
        self.recording = recording
        for _ in range(round(10 * duration_s)):
            self.node.send(PLAYER_STATE_TOPIC, PlayerState(
                stamp=self.node.now(), rate=1.0, paused=True, since=self.since,
                files=[recording], not_begun=list(not_begun)))
            self.node.advance(0.1)

    def markers(self, wait_s: float = 0.15) -> Dict[Tuple[str, int], Marker]:
        """Let time pass, and draw."""
        self.node.advance(wait_s)
        for message in self.node.sent('marker_array'):
            self._markers.update({(it.ns, it.id): it for it in message.markers})
        return self._markers

    def text(self, namespace: str, wait_s: float = 0.15) -> str:
        """Let time pass, and return the text beside an arrow."""
        return str(self.markers(wait_s)[namespace, 1].text.strip())


def test_model_arrows_and_numbers():
    machine = Machine()
    assert list(machine.markers(0.0)) == [('machine', 0)]  # before there is any data
    machine.send()
    markers = machine.markers()
    assert {name: marker.text.strip() for (name, number), marker in markers.items() if number} == {
        'feed_rate': 'feed 0.062 m/s', 'edge_upper': 'upper edge 310, 10 above 300',
        'edge_lower': 'lower edge 225, 30 below 255'}
    mesh = markers['machine', 0]
    assert (mesh.type, mesh.header.frame_id) == (Marker.MESH_RESOURCE, 'sewing_machine/base')
    assert mesh.mesh_resource == 'package://sewing_cell/meshes/sewing_machine.dae'
    for name in ('feed_rate', 'edge_upper', 'edge_lower'):
        arrow = markers[name, 0]
        assert (arrow.type, arrow.action, arrow.header.frame_id) == (
            Marker.ARROW, Marker.ADD, 'sewing_machine/needle')


def test_setpoints_are_read_live():
    machine = Machine()
    machine.send()
    assert machine.text('edge_lower') == 'lower edge 225, 30 below 255'
    machine.node.params['/sewing_machine/setpoint_lower'] = 225.0
    assert machine.text('edge_lower') == 'lower edge 225, at 225'
    assert machine.markers()['edge_lower', 0].action == Marker.DELETE
    del machine.node.params['/sewing_machine/setpoint_lower']
    assert machine.text('edge_lower') == 'lower edge 225, 30 below 255'


def test_sensors_that_stopped_are_shown():
    machine = Machine()
    machine.send()
    assert machine.text('feed_rate', 0.95) == 'feed 0.062 m/s'
    assert machine.text('feed_rate', 1.05) in ('feed no data for 1.9 s', 'feed no data for 2.0 s')
    assert machine.text('edge_upper').startswith('upper edge no data for 2.')


def test_what_is_not_of_the_recording_grows_old_and_what_has_not_begun_has_no_value():
    machine = Machine()
    machine.play('one.bag', 0.5)
    machine.send()
    machine.play('one.bag', 3.0)  # paused there
    assert machine.text('feed_rate') == 'feed 0.062 m/s'
    machine.play('another.bag', 3.0)
    assert machine.text('feed_rate').startswith('feed no data for 3.')
    machine.play('another.bag', 2.0)
    assert machine.text('feed_rate').startswith('feed no data for 5.')
    machine.send()
    assert machine.text('feed_rate') == 'feed 0.062 m/s'
    machine.play('another.bag', 0.5, not_begun=['/feed_rate_est'])
    assert machine.text('feed_rate') == 'feed no data'
    assert machine.text('edge_upper') == 'upper edge 310, 10 above 300'


def test_no_mesh_where_none_is_wanted():
    machine = Machine(mesh='')
    machine.send()
    assert machine.text('feed_rate') and ('machine', 0) not in machine.markers()


def test_a_feed_rate_that_is_no_number_leaves_the_last_one():
    machine = Machine()
    machine.send()
    for feed in (float('nan'), float('inf')):
        machine.send(feed)
        assert machine.text('feed_rate') == 'feed 0.062 m/s'
    assert machine.node.log == [('warn', 'sewing_machine: /feed_rate_est is NaN or infinite; the '
                                         'last good value stays')]


def test_markers_have_their_rate_and_only_for_somebody():
    machine = Machine(marker_rate=20.0)
    machine.node.sent('marker_array').clear()
    machine.node.advance(1.999)
    assert len(machine.node.sent('marker_array')) == 39
    machine.node.publishers['/sewing_machine/marker_array'].connections = 0
    machine.node.advance(2.0)
    assert len(machine.node.sent('marker_array')) == 39
