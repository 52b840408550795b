"""What the recorder writes into a bag beside the devices' topics; all of it is std_msgs/String."""
from __future__ import annotations

import json
import os
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence

from process_visualizer.bags.bag_errors import BagDamaged
from process_visualizer.bags.bag_records import u32_at
from process_visualizer.bags.recording import Recording

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


def configuration_text(files: Sequence[str], arguments: Mapping[str, str]) -> str:
    """Return what is stored of a configuration: its files, the first one including the others.

    Raises:
        OSError: a file cannot be read.
    """
    contents = {}
    for file in files:
        with open(file, encoding='utf-8') as stream:
            contents[os.path.abspath(file)] = stream.read()
    return json.dumps({'file': os.path.abspath(files[0]), 'files': contents,
                       'arguments': dict(arguments)}, ensure_ascii=False)


class StoredConfiguration(NamedTuple):
    """A configuration of a bag: the path it had, the texts of its files by path, its arguments."""

    file: str
    files: Dict[str, str]
    arguments: Dict[str, str]


def stored_configuration(recording: Recording) -> Optional[StoredConfiguration]:
    """Return the configuration that a recording was made with, or None."""
    value = last_json(recording, CONFIGURATION)
    if value is None:
        return None
    files, arguments = value.get('files'), value.get('arguments')
    main = os.path.abspath(str(value.get('file')))
    if not isinstance(files, dict) or not isinstance(arguments, dict):
        return None
    texts_by_path = {os.path.abspath(str(path)): str(text) for path, text in files.items()}
    if main not in texts_by_path:
        return None
    return StoredConfiguration(main, texts_by_path,
                               {str(name): str(text) for name, text in arguments.items()})


def write_configuration(configuration: StoredConfiguration, folder: str) -> str:
    """Write the files into a folder, as they lay beside each other; return the first one's path.

    Raises:
        FileExistsError: there is such a file already.
        OSError: a file cannot be written.
    """
    top = os.path.commonpath([os.path.dirname(file) for file in configuration.files])
    for file, text in configuration.files.items():
        path = os.path.join(folder, os.path.relpath(file, top))
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, 'x', encoding='utf-8') as stream:
            stream.write(text)
    return os.path.join(folder, os.path.relpath(configuration.file, top))
