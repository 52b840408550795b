# SPDX-License-Identifier: BSD-3-Clause
"""Converts a configuration to one text, which every recording has, and back to files."""
from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any, Dict, List, NamedTuple

from process_visualizer.cell.model import Cell

MODEL_ENDINGS = ('.urdf', '.xacro')
_ENDINGS = ('.xml', *MODEL_ENDINGS)
"""Of all files of a configuration: no other program takes such a file for its own."""


class StoredConfiguration(NamedTuple):
    """The path that a configuration had, the texts of its files by path, its arguments."""

    file: str
    files: Dict[str, str]
    arguments: Dict[str, str]


def configuration_text(cell: Cell) -> str:
    """Return a cell's files, with models beside them, and its arguments as JSON in ASCII.

    Bytes of a file that are not UTF-8 are kept (as lone surrogates).

    Raises:
        OSError: a file cannot be read.
    """
    texts = {file: Path(file).read_bytes().decode('utf-8', 'surrogateescape')
             for file in [*cell.files, *_models_beside(cell)]}
    return json.dumps({'file': cell.file, 'files': texts, 'arguments': dict(cell.arguments)})


def _models_beside(cell: Cell) -> List[str]:
    """The models in the folder of a configuration instead of a package."""
    models = [device.model for device in cell.devices if device.model is not None]
    return [model.path for model in models if not model.package and os.path.isfile(model.path)]


def with_models_beside(stored: StoredConfiguration) -> StoredConfiguration:
    """Return a configuration with those models beside it that were outside of its folder.

    That is possible where it names them by their path, not by an argument.
    """
    folder = os.path.dirname(stored.file)
    files = dict(stored.files)
    for model in [it for it in files if it.endswith(MODEL_ENDINGS)]:
        if os.path.relpath(model, folder).startswith(os.pardir):
            place = os.path.join(folder, os.path.basename(model))
            texts = {file: _naming(text, file, model, place) for file, text in files.items()}
            if place not in files and texts != files:
                text = texts.pop(model)
                files = {**texts, place: text}
    return stored._replace(files=files)


def _naming(text: str, file: str, model: str, place: str) -> str:
    """The text of a file that names a model at another place."""
    before, behind = (os.path.relpath(it, os.path.dirname(file)) for it in (model, place))
    names = '|'.join(map(re.escape, (model, before, f'$(dirname)/{before}')))
    return re.sub(rf'(<model\b[^<>]*\bpath\s*=\s*)(["\'])(?:{names})\2',
                  lambda it: f'{it[1]}{it[2]}{behind}{it[2]}', text)


def stored_configuration(value: Dict[str, Any]) -> StoredConfiguration:
    """Return the configuration in the JSON of `configuration_text`.

    Raises:
        ValueError: the JSON has another content.
    """
    files = {os.path.abspath(path): text for path, text in _texts(value, 'files').items()}
    if not isinstance(value.get('file'), str) or os.path.abspath(value['file']) not in files:
        raise ValueError('"file" is not one of its files')
    for path, text in files.items():
        text.encode('utf-8', 'surrogateescape')
        if not os.fsencode(path) or '\0' in path:
            raise ValueError('the name of a file contains a zero byte')
        if not path.endswith(_ENDINGS) or os.path.basename(path).startswith('.') or '$' in path:
            raise ValueError(f'{path!a} is not the name of a configuration or a model, which end '
                             f'in {", ".join(_ENDINGS)}')
    return StoredConfiguration(os.path.abspath(value['file']), files, _texts(value, 'arguments'))


def _texts(value: Dict[str, Any], name: str) -> Dict[str, str]:
    """The texts by name in one member of the JSON."""
    found = value.get(name)
    if not isinstance(found, dict) or not all(isinstance(it, str) for it in found.values()):
        raise ValueError(f'"{name}" does not map names to texts')
    return found


def write_configuration(configuration: StoredConfiguration, folder: str) -> str:
    """Write the files into a folder, in their former layout; return the path of the first.

    Models that were outside of the configuration's folder are beside it.

    Raises:
        FileExistsError: a file exists already.
        OSError: a file cannot be written.
    """
    files = with_models_beside(configuration).files
    top = os.path.commonpath([os.path.dirname(file) for file in files])
    for file, text in files.items():
        path = Path(folder, os.path.relpath(file, top))
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open('xb') as stream:
            stream.write(text.encode('utf-8', 'surrogateescape'))
    return os.path.join(folder, os.path.relpath(configuration.file, top))
