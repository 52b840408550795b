"""A configuration as one text, as it is stored in every recording, and back to files."""
from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Dict, NamedTuple, Optional

from process_visualizer.cell.model import Cell


class StoredConfiguration(NamedTuple):
    """The path that a configuration had, the texts of its files by path, its arguments."""

    file: str
    files: Dict[str, str]
    arguments: Dict[str, str]


def configuration_text(cell: Cell) -> str:
    """Return a cell's files and arguments as JSON in ASCII.

    What is not UTF-8 in a file is kept as it is (as lone surrogates).

    Raises:
        OSError: a file cannot be read.
    """
    texts = {file: Path(file).read_bytes().decode('utf-8', 'surrogateescape')
             for file in cell.files}
    return json.dumps({'file': cell.file, 'files': texts, 'arguments': dict(cell.arguments)})


def stored_configuration(value: Optional[Dict[str, Any]]) -> Optional[StoredConfiguration]:
    """Return what `configuration_text` has written, from its JSON; None if that is not it."""
    if value is None:
        return None
    files, arguments = value.get('files'), value.get('arguments')
    main = os.path.abspath(str(value.get('file')))
    if not isinstance(files, dict) or not isinstance(arguments, dict):
        return None
    texts = {os.path.abspath(str(path)): str(text) for path, text in files.items()}
    if main not in texts:
        return None
    return StoredConfiguration(main, texts,
                               {str(name): str(text) for name, text in arguments.items()})


def write_configuration(configuration: StoredConfiguration, folder: str) -> str:
    """Write the files into a folder, as they lay beside each other; return the first one's path.

    Raises:
        FileExistsError: there is such a file already.
        OSError: a file cannot be written.
    """
    top = os.path.commonpath([os.path.dirname(file) for file in configuration.files])
    for file, text in configuration.files.items():
        path = Path(folder, os.path.relpath(file, top))
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open('xb') as stream:
            stream.write(text.encode('utf-8', 'surrogateescape'))
    return os.path.join(folder, os.path.relpath(configuration.file, top))
