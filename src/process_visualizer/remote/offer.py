# SPDX-License-Identifier: BSD-3-Clause
"""The offer of a running cell to viewers: view, models and topics, all of them untrusted data."""
from __future__ import annotations

import hashlib
import re
from typing import Any, Dict, Iterator, Mapping, NamedTuple, Tuple

import rosgraph.names

DEFAULT_PORTS = range(11411, 11419)
"""Ports of the relay, which listens on the first free one."""
ADDRESS_PARAMETER = '/view_relay/address'
"""Parameter on the master with the relay's address."""
MESH_ENDINGS = ('.stl', '.dae', '.obj', '.mesh', '.ply', '.png', '.jpg', '.jpeg', '.tga', '.mtl')
"""Endings of files that a relay gives to viewers: meshes and their textures."""
MAX_MESH_BYTES = 48 << 20
_TYPE = re.compile(r'[A-Za-z]\w*/[A-Za-z]\w*', re.ASCII)
_MD5 = re.compile('[0-9a-f]{32}')
_MAX_TOPICS = 2000


class OfferedTopic(NamedTuple):
    """A topic that viewers may request; ``type`` is `package/Type`."""

    type: str
    md5sum: str
    definition: str


class OfferedMesh(NamedTuple):
    """A file named in a model: its size [bytes] and SHA-256."""

    size: int
    digest: str


class Offer(NamedTuple):
    """The first message to a viewer.

    ``view`` is the content of an .rviz file; ``models`` has the descriptions by parameter, and
    ``meshes`` the files by their URIs in the descriptions. ``cell`` (computer and port of its ROS
    master) distinguishes cells of one computer; it is empty from versions that do not send it.
    """

    version: str
    mode: str
    view: str
    models: Dict[str, str]
    meshes: Dict[str, OfferedMesh]
    cell: str = ''

    def values(self) -> Dict[str, Any]:
        """Return the offer as a JSON object."""
        return {'version': self.version, 'mode': self.mode, 'view': self.view,
                'cell': self.cell, 'models': self.models,
                'meshes': {uri: list(mesh) for uri, mesh in self.meshes.items()}}


def are_different(cell: str, other: str) -> bool:
    """Return whether two offers (their ``cell``) are known to be of different cells."""
    return bool(cell and other) and cell != other


def offer_of(values: Mapping[str, Any]) -> Offer:
    """Return the offer in a JSON object.

    Raises:
        ValueError: the object is not an offer.
    """
    meshes = {}
    for uri, pair in _pairs(values, 'meshes'):
        if not (isinstance(pair, list) and len(pair) == 2 and type(pair[0]) is int
                and 0 <= pair[0] <= MAX_MESH_BYTES and isinstance(pair[1], str)):
            raise ValueError('"meshes" gives no size for a mesh')
        meshes[uri] = OfferedMesh(pair[0], pair[1])
    models = dict(_pairs(values, 'models'))
    for name, text in models.items():
        if not rosgraph.names.is_legal_name(name) or not isinstance(text, str):
            raise ValueError(f'{name!a} is not the parameter of a model')
    texts = [values.get(it) for it in ('version', 'mode', 'view')]
    if not all(isinstance(it, str) for it in texts):
        raise ValueError('version, mode or view is missing or not a string')
    version, mode, view = map(str, texts)
    cell = values.get('cell')
    return Offer(version, mode, view, models, meshes, cell if isinstance(cell, str) else '')


def topics_of(values: Mapping[str, Any]) -> Dict[str, OfferedTopic]:
    """Return the topics in a JSON object, by name.

    Raises:
        ValueError: the object holds no topics, or a name or type is not allowed.
    """
    found: Dict[str, OfferedTopic] = {}
    for name, parts in _pairs(values, 'topics'):
        if not (isinstance(parts, list) and len(parts) == 3
                and all(isinstance(it, str) for it in parts)):
            raise ValueError(f'the topic {name!a} has no type')
        topic = OfferedTopic(*parts)
        if not name.startswith('/') or not rosgraph.names.is_legal_name(name):
            raise ValueError(f'{name!a} is not a valid topic name')
        if not _TYPE.fullmatch(topic.type) or not _MD5.fullmatch(topic.md5sum):
            raise ValueError(f'the topic {name} has the type {topic.type!a}')
        found[name] = topic
    if len(found) > _MAX_TOPICS:
        raise ValueError(f'{len(found)} topics')
    return found


def topics_message(topics: Mapping[str, OfferedTopic]) -> Dict[str, Any]:
    """Return topics as a JSON object."""
    return {name: list(topic) for name, topic in topics.items()}


def named_topics(view: Any) -> Iterator[str]:
    """Yield the absolute names among a view's values: topics, and anything that looks like one."""
    if isinstance(view, dict):
        for value in view.values():
            yield from named_topics(value)
    elif isinstance(view, list):
        for value in view:
            yield from named_topics(value)
    elif isinstance(view, str) and view.startswith('/') and rosgraph.names.is_legal_name(view):
        yield view


def digest_of(data: bytes) -> str:
    """Return the SHA-256 of a file."""
    return hashlib.sha256(data).hexdigest()


def _pairs(values: Mapping[str, Any], name: str) -> Iterator[Tuple[str, Any]]:
    found = values.get(name)
    if not isinstance(found, dict):
        raise ValueError(f'"{name}" is missing')
    yield from found.items()
