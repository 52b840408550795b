# SPDX-License-Identifier: BSD-3-Clause
"""Addresses and ports as users write them, and where a program of this computer listens."""
from __future__ import annotations

import ipaddress
import socket
from typing import Mapping, NamedTuple, Optional
from urllib.parse import urlparse

from process_visualizer.remote.offer import DEFAULT_PORTS

MASTER_PORT = 11311
LOCAL = '127.0.0.1'
_EVERYWHERE = '0.0.0.0'


class Address(NamedTuple):
    """A computer, and a port or None."""

    host: str
    port: Optional[int]

    def __str__(self) -> str:
        return self.host if self.port is None else f'{self.host}:{self.port}'


def address_of(text: str) -> Address:
    """Return what HOST, HOST:PORT or http://HOST:PORT stands for.

    Raises:
        ValueError: it is none of these.
    """
    try:
        parsed = urlparse(text if '://' in text else f'//{text}')
        host, port = parsed.hostname, parsed.port
    except ValueError:
        host = port = None
    if not host or parsed.path.strip('/') or port == 0:
        raise ValueError(f'"{text}" is no address; write the name or the address of the computer '
                         'on which the cell runs, with a port if needed: cell-pc, or '
                         'cell-pc:11311')
    return Address(host, port)


def ports_of(text: str) -> range:
    """Return the ports in FIRST-LAST, or in one number.

    Raises:
        ValueError: it is neither.
    """
    first, separator, last = text.partition('-')
    try:
        ports = range(int(first), int(last if separator else first) + 1)
    except ValueError:
        ports = range(0)
    if not ports or ports[0] < 1 or ports[-1] > 65535:
        raise ValueError(f'"{text}" are no ports; write the first and the last, such as '
                         f'{DEFAULT_PORTS[0]}-{DEFAULT_PORTS[-1]}')
    return ports


def listening_address(environment: Mapping[str, str], is_remote: bool) -> str:
    """Return where the relay listens: at ROS_IP or ROS_HOSTNAME; else here, or everywhere.

    ``is_remote`` says that other computers may watch, whatever the nodes do.
    """
    for name in ('ROS_IP', 'ROS_HOSTNAME'):
        value = environment.get(name, '').strip()
        if value and not (is_remote and is_loopback(value)):
            return value
    return _EVERYWHERE if is_remote else LOCAL


def is_loopback(host: str) -> bool:
    """Return whether an address or name can only be this computer; a name is looked up."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        pass
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        return False
    return bool(found) and all(ipaddress.ip_address(it[4][0].split('%')[0]).is_loopback
                               for it in found)
