# SPDX-License-Identifier: BSD-3-Clause
"""Other computers on which a launch file starts nodes, and whether they can be reached."""
from __future__ import annotations

import socket
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Sequence, Tuple
from xml.etree import ElementTree

_ANSWER_S = 1.5
_SSH_PORT = 22


class FarComputer(NamedTuple):
    """A ``<machine>`` and the nodes that run on it."""

    name: str
    address: str
    port: int
    nodes: Tuple[str, ...]

    def __str__(self) -> str:
        """Return nodes and computer in words."""
        return f'{", ".join(self.nodes) or "what runs"} on {self.name} ({self.address})'


def far_computers(launch_file: str) -> List[FarComputer]:
    """Return the computers in a generated launch file; none if it cannot be read."""
    try:
        root = ElementTree.fromstring(Path(launch_file).read_bytes())
    except (OSError, ElementTree.ParseError):
        return []
    nodes: Dict[str, List[str]] = {}
    for machine, node in _nodes_by_machine(root, '/'):
        nodes.setdefault(machine, []).append(node)
    return [FarComputer(name, element.get('address', ''), _port(element.get('ssh-port', '')),
                        tuple(nodes.get(name, ())))
            for element in root.iter('machine') for name in [element.get('name', '')]]


def _nodes_by_machine(element: ElementTree.Element, namespace: str) -> Iterator[Tuple[str, str]]:
    for child in element:
        if child.tag == 'group':
            yield from _nodes_by_machine(child, f'{namespace}{child.get("ns", "").strip("/")}/'
                                         .replace('//', '/'))
        elif child.tag == 'node':
            yield child.get('machine', ''), namespace + child.get('name', '')


def _port(text: str) -> int:
    return int(text) if text.isdecimal() else _SSH_PORT


def silent(computers: Sequence[FarComputer]) -> List[FarComputer]:
    """Return the computers that do not answer; takes some seconds at most.

    A refused connection is an answer. A computer whose address only SSH knows is not returned.
    """
    if not computers:
        return []
    with ThreadPoolExecutor(len(computers), 'ask computer') as pool:
        return [it for it, answers in zip(computers, pool.map(_answers, computers)) if not answers]


def _answers(computer: FarComputer) -> bool:
    try:
        with socket.create_connection((computer.address, min(computer.port, 65535)), _ANSWER_S):
            return True
    except (ConnectionRefusedError, socket.gaierror, UnicodeError):
        return True
    except OSError:
        return False
