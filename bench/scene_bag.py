# SPDX-License-Identifier: BSD-3-Clause
"""Makes a bag of large images and small topics; each message has its index.

Images of 2.5 MB at 30 Hz (75 MB/s), arrays at 125 Hz, transforms at 50 Hz, markers of 60 kB at
10 Hz and texts at 5 Hz. No two messages have the same time.
"""
from __future__ import annotations

import io
from functools import partial
from pathlib import Path
from typing import Any

from bag_maker import BagTopic, MadeBag, made_bag
from geometry_msgs.msg import Point, TransformStamped
from message_index import array_message, text_message
from sensor_msgs.msg import Image
from std_msgs.msg import Float32MultiArray, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

_IMAGE = Image(height=720, width=1160, encoding='rgb8', step=3480, data=bytes(720 * 3480))
_TRANSFORM = TransformStamped(child_frame_id='tool')
_MARKER = Marker(type=Marker.LINE_LIST, points=[Point()] * 2500)


def scene_bag(folder: str, length_s: float) -> MadeBag:
    """Return the bag of this many seconds from the folder; write it if it does not exist."""
    topics = [BagTopic('/image', 30, Image, partial(_stamped, _IMAGE, _IMAGE)),
              BagTopic('/array', 125, Float32MultiArray,
                       lambda index, _time_ns: array_message(index, [1.0] * 6)),
              BagTopic('/tf', 50, TFMessage,
                       partial(_stamped, TFMessage([_TRANSFORM]), _TRANSFORM)),
              BagTopic('/markers', 10, MarkerArray,
                       partial(_stamped, MarkerArray([_MARKER]), _MARKER)),
              BagTopic('/text', 5, String, lambda index, _time_ns: text_message(index, 24))]
    return made_bag(Path(folder) / f'scene_{length_s:g}_s.bag', topics, length_s)


def _stamped(message: Any, part: Any, index: int, time_ns: int) -> bytes:
    """A message whose part with a header has an index and a stamp."""
    part.header.seq, part.header.frame_id = index, 'world'
    part.header.stamp.secs, part.header.stamp.nsecs = divmod(time_ns, 1_000_000_000)
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()
