# SPDX-License-Identifier: BSD-3-Clause
"""Converts a configuration to one text, which every recording contains, and back to files."""
from __future__ import annotations

import errno
import json
import os
import re
from pathlib import Path
from typing import Any, Dict, List, NamedTuple

from process_visualizer.cell.model import Cell

MODEL_ENDINGS = ('.urdf', '.xacro')
_ENDINGS = ('.xml', *MODEL_ENDINGS)
"""File name endings of a configuration. Other programs do not run or read such files on their own,
except in hidden folders, such as a window manager's menu."""
_MAX_FILES = 1000


class StoredConfiguration(NamedTuple):
    """The original path of a configuration, the texts of its files by path, and its arguments."""

    file: str
    files: Dict[str, str]
    arguments: Dict[str, str]


def configuration_text(cell: Cell) -> str:
    """Return a cell's files, including models outside packages, and its arguments as ASCII JSON.

    Bytes that are not UTF-8 are kept as lone surrogates.

    Raises:
        OSError: a file cannot be read.
    """
    texts = {file: Path(file).read_bytes().decode('utf-8', 'surrogateescape')
             for file in [*cell.files, *_models_beside(cell)]}
    return json.dumps({'file': cell.file, 'files': texts, 'arguments': dict(cell.arguments)})


def _models_beside(cell: Cell) -> List[str]:
    """Return the paths of models that are not in a package."""
    models = [device.model for device in cell.devices if device.model is not None]
    return [model.path for model in models if not model.package and os.path.isfile(model.path)]


def with_models_beside(stored: StoredConfiguration) -> StoredConfiguration:
    """Return a configuration whose models from outside its folder are moved beside it.

    A model can be moved only if the configuration contains its path, not an argument.
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
    """Return the text of a file with the path of a model replaced."""
    before, behind = (os.path.relpath(it, os.path.dirname(file)) for it in (model, place))
    names = '|'.join(map(re.escape, (model, before, f'$(dirname)/{before}')))
    return re.sub(rf'(<model\b[^<>]*\bpath\s*=\s*)(["\'])(?:{names})\2',
                  lambda it: f'{it[1]}{it[2]}{behind}{it[2]}', text)


def stored_configuration(value: Dict[str, Any]) -> StoredConfiguration:
    """Return the configuration from the JSON of `configuration_text`.

    Raises:
        ValueError: the JSON does not describe a configuration, or has too many files.
    """
    files = {os.path.abspath(path): text for path, text in _texts(value, 'files').items()}
    if not isinstance(value.get('file'), str) or os.path.abspath(value['file']) not in files:
        raise ValueError('"file" is not one of its files')
    if len(files) > _MAX_FILES:
        raise ValueError(f'it has {len(files)} files; at most {_MAX_FILES} are allowed')
    for path, text in files.items():
        text.encode('utf-8', 'surrogateescape')
        if not os.fsencode(path) or '\0' in path:
            raise ValueError('the name of a file contains a zero byte')
        if not path.endswith(_ENDINGS) or os.path.basename(path).startswith('.') or '$' in path:
            raise ValueError(f'{path!a} is not the name of a configuration or a model, which end '
                             f'in {", ".join(_ENDINGS)}')
    return StoredConfiguration(os.path.abspath(value['file']), files, _texts(value, 'arguments'))


def _texts(value: Dict[str, Any], name: str) -> Dict[str, str]:
    """Return the texts by name in one member of the JSON."""
    found = value.get(name)
    if not isinstance(found, dict) or not all(isinstance(it, str) for it in found.values()):
        raise ValueError(f'"{name}" does not map names to texts')
    return found


def write_configuration(configuration: StoredConfiguration, folder: str) -> str:
    """Write the files into a folder, in their original layout; return the configuration's path.

    Models from outside the configuration's folder are written beside it.

    Raises:
        FileExistsError: a file already exists.
        OSError: a file cannot be written, or would be in a hidden folder below this one.
    """
    files = with_models_beside(configuration).files
    top = os.path.commonpath([os.path.dirname(file) for file in files])
    names = {file: os.path.relpath(file, top) for file in files}
    for name in names.values():
        if any(part.startswith('.') for part in name.split(os.sep)):
            raise OSError(errno.EPERM, 'a configuration may not write into a hidden folder', name)
    for file, text in files.items():
        path = Path(folder, names[file])
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open('xb') as stream:
            stream.write(text.encode('utf-8', 'surrogateescape'))
    return os.path.join(folder, os.path.relpath(configuration.file, top))
