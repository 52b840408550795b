# SPDX-License-Identifier: BSD-3-Clause
"""Messages that can control the rate of playback."""
import pytest
from geometry_msgs.msg import PointStamped
from std_msgs.msg import Header, Int32
from tf2_msgs.msg import TFMessage

from process_visualizer.player.bag_player import begins_with_header


@pytest.mark.parametrize('definition, expected', [
    (PointStamped._full_text, True), ('# a comment\n\n  # another\nstd_msgs/Header header\n', True),
    ('Header header', True), (Int32._full_text, False), (TFMessage._full_text, False),
    (Header._full_text, False), ('int32 first\nHeader header', False), ('# Header header', False),
    ('HeaderLike header', False), ('', False)])
def test_only_those_that_begin_with_a_header(definition, expected):
    assert begins_with_header(definition) is expected
