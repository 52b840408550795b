"""What the recorder writes into a bag beside the devices' topics; all of it is std_msgs/String."""
from __future__ import annotations

import json
from typing import Any, Dict, List, NamedTuple, Optional

from process_visualizer.bags.bag_errors import BagDamaged
from process_visualizer.bags.bag_records import u32_at
from process_visualizer.bags.recording import Recording
from process_visualizer.cell.stored_configuration import StoredConfiguration, stored_configuration

PREFIX = '/process_visualizer/'
CONFIGURATION = f'{PREFIX}configuration'
CALIBRATION = f'{PREFIX}calibration'
MARKS = f'{PREFIX}marks'
ACCOUNT = f'{PREFIX}recording'
"""Topics: the configuration's files, the base frames (tf2_msgs/TFMessage), the marks, and the
recorder's account of what it dropped."""


class Text(NamedTuple):
    """A text of a bag and its time [ns since the epoch]."""

    time_ns: int
    text: str


def texts(recording: Recording, topic: str) -> List[Text]:
    """Return the messages of a topic of type std_msgs/String, in the order of time.

    Messages that cannot be read are left out; ``recording.gaps`` has them.
    """
    found = []
    for position in recording.index.positions_of(recording.index.connections_of(topic)).tolist():
        try:
            message = recording.message(position)
        except BagDamaged:
            continue
        data = bytes(message[4:4 + u32_at(message, 0)])
        found.append(Text(int(recording.index.time_ns[position]), data.decode('utf-8', 'replace')))
    return found


def last_json(recording: Recording, topic: str) -> Optional[Dict[str, Any]]:
    """Return the last message of a topic that is a JSON object, or None."""
    for message in reversed(texts(recording, topic)):
        try:
            value = json.loads(message.text)
        except ValueError:
            continue
        if isinstance(value, dict):
            return value
    return None


def recorded_configuration(recording: Recording) -> Optional[StoredConfiguration]:
    """Return the configuration that a recording was made with, or None."""
    return stored_configuration(last_json(recording, CONFIGURATION))
