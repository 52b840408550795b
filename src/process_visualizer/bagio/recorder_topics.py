# SPDX-License-Identifier: BSD-3-Clause
"""The recorder's own topics in a bag, all of type std_msgs/String except those of frames."""
from __future__ import annotations

from typing import Any, Dict, List, NamedTuple, Optional, Tuple

from process_visualizer.bagio.bag_errors import BagDamaged, RecordError
from process_visualizer.bagio.bag_file import sized_part
from process_visualizer.bagio.json_text import parsed_json
from process_visualizer.bagio.message_definition import short_name
from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.stored_configuration import StoredConfiguration, stored_configuration
from process_visualizer.ros_names import OWN_TOPICS

CONFIGURATION = f'{OWN_TOPICS}configuration'
CALIBRATION = f'{OWN_TOPICS}calibration'
STATIC_FRAMES = f'{OWN_TOPICS}static_frames'
MARKS = f'{OWN_TOPICS}marks'
ACCOUNT = f'{OWN_TOPICS}recording'
"""Topics of the configuration's files, the base frames, all other fixed frames (both of type
tf2_msgs/TFMessage), the marks, and the recorder's account of the messages that it dropped."""
_TEXT_TYPE = 'std_msgs/String'


class Text(NamedTuple):
    """A text in a bag and its time [ns since the epoch]."""

    time_ns: int
    text: str


def texts(recording: Recording, topic: str) -> List[Text]:
    """Return the messages of a topic of type std_msgs/String, in the order of time.

    Unreadable messages and those of other types are left out and added to ``recording.gaps``.
    """
    return [text for _, text in _placed_texts(recording, topic)]


def last_json(recording: Recording, topic: str) -> Optional[Dict[str, Any]]:
    """Return the last message of a topic that is a JSON object, or None.

    Other messages are skipped and added to ``recording.gaps``.
    """
    for position, message in reversed(_placed_texts(recording, topic)):
        try:
            return _json_object(message.text)
        except ValueError as error:
            recording.note(position, f'it is not a JSON object: {error}')
    return None


def recorded_configuration(recording: Recording) -> Optional[StoredConfiguration]:
    """Return the configuration that was used for a recording, or None.

    Invalid ones are skipped and added to ``recording.gaps``.
    """
    for position, message in reversed(_placed_texts(recording, CONFIGURATION)):
        try:
            return stored_configuration(_json_object(message.text))
        except ValueError as error:
            recording.note(position, f'it is not a configuration: {error}')
    return None


def _placed_texts(recording: Recording, topic: str) -> List[Tuple[int, Text]]:
    """Return the texts with their positions in the index."""
    index = recording.index
    found = []
    for position in index.positions_of(index.connections_of(topic)).tolist():
        connection = index.connections[int(index.connection[position])]
        try:
            text = _string(connection.type, recording.message(position))
            found.append((position, Text(int(index.time_ns[position]), text)))
        except BagDamaged:
            continue  # already noted
        except RecordError as error:
            recording.note(position, str(error))
    return found


def _string(kind: str, message: memoryview) -> str:
    """Return the text of a std_msgs/String.

    Raises:
        RecordError: the message is not a std_msgs/String.
    """
    if short_name(kind) != _TEXT_TYPE:
        raise RecordError(f'it is a {kind}, not a {_TEXT_TYPE}')
    begin, end = sized_part(message, 0)
    if end != len(message):
        raise RecordError(f'a {_TEXT_TYPE} ends at byte {end}, and it has {len(message)}')
    return bytes(message[begin:end]).decode('utf-8', 'replace')


def _json_object(text: str) -> Dict[str, Any]:
    """Return the JSON object in a text.

    Raises:
        ValueError: the text is not a JSON object.
    """
    value = parsed_json(text)
    if not isinstance(value, dict):
        raise ValueError('it does not begin with "{"')
    return value
