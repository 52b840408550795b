# SPDX-License-Identifier: BSD-3-Clause
"""Messages about faults between a viewer and a cell: what, where, and what to do."""
from __future__ import annotations

import errno
import ipaddress
import socket
from typing import Any, Mapping, NamedTuple, Optional, Tuple
from urllib.parse import urlparse

from process_visualizer.remote.offer import DEFAULT_PORTS, OfferedTopic

MASTER_PORT = 11311
LOCAL = '127.0.0.1'
_EVERYWHERE = '0.0.0.0'


class Address(NamedTuple):
    """A computer, and a port if known."""

    host: str
    port: Optional[int]

    def __str__(self) -> str:
        return self.host if self.port is None else f'{bracketed(self.host)}:{self.port}'


def bracketed(host: str) -> str:
    """Return a host as it is written before a port: an IPv6 address in brackets."""
    return f'[{host}]' if ':' in host else host


def address_of(text: str) -> Address:
    """Return the address in HOST, HOST:PORT or http://HOST:PORT.

    Raises:
        ValueError: the text is none of these.
    """
    text = text.strip()
    try:
        if ':' in text and ipaddress.ip_address(text.partition('%')[0]).version == 6:
            return Address(text, None)
    except ValueError:
        pass  # a port, or a name
    try:
        parsed = urlparse(text if '://' in text else f'//{text}')
        host, port = parsed.hostname, parsed.port
    except ValueError:
        host = port = None
    if not host or parsed.path.strip('/') or port == 0:
        raise ValueError(f'"{text}" is not an address; write the name or address of the computer '
                         'on which the cell runs, with a port if needed: cell-pc, or '
                         'cell-pc:11311')
    return Address(host, port)


def ports_of(text: str) -> range:
    """Return the ports in FIRST-LAST, or in a single number.

    Raises:
        ValueError: the text is neither.
    """
    first, separator, last = text.partition('-')
    try:
        ports = range(int(first), int(last if separator else first) + 1)
    except ValueError:
        ports = range(0)
    if not ports or ports[0] < 1 or ports[-1] > 65535:
        raise ValueError(f'"{text}" is not a range of ports; write the first and the last, such as '
                         f'{DEFAULT_PORTS[0]}-{DEFAULT_PORTS[-1]}')
    return ports


def listening_address(environment: Mapping[str, str], is_remote: bool) -> str:
    """Return the relay's listening address: ROS_IP or ROS_HOSTNAME, else loopback or all.

    ``is_remote`` allows other computers to watch, whatever addresses the nodes use.
    """
    for name in ('ROS_IP', 'ROS_HOSTNAME'):
        value = environment.get(name, '').strip()
        if value and not (is_remote and is_loopback(value)):
            return value
    return _EVERYWHERE if is_remote else LOCAL


def is_loopback(host: str) -> bool:
    """Return whether an address or name is that of the loopback interface; names are resolved."""
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


def not_this_computer(environment: Mapping[str, str]) -> Optional[str]:
    """Return a message if ROS_IP or ROS_HOSTNAME names another computer, else None."""
    for name in ('ROS_HOSTNAME', 'ROS_IP'):
        value = environment.get(name, '').strip()
        if value and not is_here(value):
            return (f'{name} is {value}, which is not an address of this computer: nodes cannot '
                    'reach each other there. Set it to one that "hostname -I" prints, or unset it')
    return None


def hidden_from_others(environment: Mapping[str, str]) -> Optional[str]:
    """Return a message if ROS_IP or ROS_HOSTNAME leads to the loopback interface, else None."""
    address = environment.get('ROS_IP', '').strip()
    name = environment.get('ROS_HOSTNAME', '').strip()
    if address:
        return (f'nobody can watch this cell: ROS_IP is {address}, an address of the loopback '
                'interface. Set it to one that "hostname -I" prints instead, or add --remote'
                ) if is_loopback(address) else None
    if name in ('', 'localhost') or not is_loopback(name):
        return None
    return (f'nobody can watch this cell: ROS_HOSTNAME is {name}, which /etc/hosts gives to the '
            'loopback interface. Set ROS_IP to an address that "hostname -I" prints instead, or '
            'add --remote')


def unnamed_here(environment: Mapping[str, str]) -> Optional[str]:
    """Return a message if nodes on other computers know this one by its host name only."""
    if any(environment.get(name, '').strip() for name in ('ROS_IP', 'ROS_HOSTNAME')):
        return None
    return (f'nodes on other computers (<machine>) know this one as "{socket.gethostname()}". If '
            'they do not start, that name is not known there: set ROS_IP to an address that '
            '"hostname -I" prints, here and in the env-loader script there')


HOW_TO_WATCH = 'others can watch with'


def how_to_watch(listens: str) -> str:
    """Return how others can watch a cell whose relay listens at an address (HOST:PORT)."""
    host, _, port = listens.rpartition(':')
    shown = socket.gethostname() if host in (_EVERYWHERE, '::') else host
    usual = int(port) == DEFAULT_PORTS[0]
    return (f'{HOW_TO_WATCH} "cell view --master {shown}{"" if usual else f":{port}"}" '
            f'(port {port} has to be open)')


def is_here(host: str) -> bool:
    """Return whether a program here can listen at a name or address."""
    try:
        found = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        return False
    return any(map(_can_listen, found))


def _can_listen(found: Tuple[Any, ...]) -> bool:
    """Return whether a program here can listen at an address as `getaddrinfo` returns it."""
    try:
        with socket.socket(*found[:3]) as probe:
            probe.bind(found[4])
    except OSError:
        return False
    return True


CLOCKS_APART_S = 0.5
_DROPPED = (errno.ETIMEDOUT, errno.EHOSTUNREACH, errno.EHOSTDOWN)
_NO_ROUTE = (errno.ENETUNREACH, errno.ENETDOWN)


def unknown_name(host: str) -> str:
    """Return the message that a name does not resolve."""
    return (f'the name "{host}" is not known on this computer: write the address of the cell\'s '
            f'computer instead ("hostname -I" there prints it), or add a line "ADDRESS {host}" to '
            '/etc/hosts')


def unreachable(address: Address, error: OSError, what: str) -> str:
    """Return why there is no connection to a port, and the remedy; ``what`` should answer there."""
    if error.errno in _NO_ROUTE:
        return (f'this computer has no way to {address.host}: its own network is down, or leads '
                'elsewhere ("ip address" and "ip route" show it)')
    if isinstance(error, socket.timeout) or error.errno in _DROPPED:
        return (f'{address} does not answer: the computer is off or in another network ("ping '
                f'{address.host}"), or a firewall drops the connection; on the cell\'s computer, '
                f'"sudo ufw allow {address.port}/tcp" opens the port of {what}')
    if isinstance(error, (ConnectionResetError, BrokenPipeError)):
        return f'{address} accepts the connection and closes it' + (
            '. If that is a tunnel, nothing listens at its other end: is the cell running there? '
            'If it has ROS_IP or ROS_HOSTNAME set, the tunnel has to lead to that address instead '
            f'of localhost: "ssh -N -L {address.port}:ADDRESS:{DEFAULT_PORTS[0]} …"'
            if is_loopback(address.host) else f': another program listens there. {_WHICH_PORT}')
    if isinstance(error, ConnectionRefusedError) and is_loopback(address.host):
        return (f'port {address.port} of {address.host} is closed: {what} does not listen there. '
                'If that is a tunnel, its ssh has ended: start it again. If the cell is on this '
                f'computer, is it running? {_WHICH_PORT}')
    if isinstance(error, ConnectionRefusedError):
        return (f'port {address.port} of {address.host} is closed: {what} does not listen there. '
                f'Is the cell running, with --remote? {_WHICH_PORT}')
    return f'{address} cannot be {"reached" if error.errno else "watched"}: ' \
           f'{error.strerror or error}'


_WHICH_PORT = ('Give the port of the cell for viewers, which "cell run --remote" prints, or none '
               'if it is the usual one')
NOT_A_MASTER = f'what answers is neither a cell nor a ROS master. {_WHICH_PORT}'
NOT_THE_CELL = 'what answers there is not the cell of this program, or one of another version'
SAYS_NOTHING = ('it accepts the connection, but says nothing: another program listens there, or '
                'the cell is stopped, or its computer is far too busy')


def another_cell(host: str, port: int) -> str:
    """Return the message that another cell of the same computer was found, which is not shown."""
    return (f'another cell runs there, at port {port}: "cell view --master '
            f'{Address(host, port)}" shows it')


def only_small_packets(host: str) -> str:
    """Return the message that large packets are lost without any notice."""
    return ('only small packets arrive: a part of the way carries less than its ends believe '
            '(MTU). Set it on both computers, such as "sudo ip link set dev NAME mtu 1280", with '
            f'the NAME that "ip route get {_address(host)}" prints behind "dev"; a VPN has a '
            'setting of its own')


def _address(host: str) -> str:
    """Return an address of a host for commands that take no names."""
    try:
        return str(socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][4][0])
    except (OSError, UnicodeError):
        return host


def closed_to_others(host: str, listens: str, port: int) -> str:
    """Return the message that a cell lets only its own computer watch, at a loopback address."""
    return (f'the cell on {host} listens to its own computer only: start it with "cell run '
            '--remote" or the launcher with remote:=true, or set ROS_IP there to the address that '
            f'you reach; or use a tunnel: "ssh -N -L {port}:{listens}:{port} {host}", and then '
            f'"cell view --master localhost:{port}"')


def relay_ended(master_uri: str, listens: str) -> str:
    """Return the message that a master of this computer names a relay that is not there."""
    port = listens.rpartition(':')[2]
    return (f'the ROS master at {master_uri} still names a cell at {listens}, but nothing listens '
            'there: the cell has been killed; start it again. If the master is another '
            f"computer's, reached by a tunnel, use the tunnel for port {port} too")


def relay_silent(host: str, listens: str, error: OSError) -> str:
    """Return why the relay of a cell cannot be reached although the master can.

    ``listens`` is the relay's own statement of its address.
    """
    address, _, port = listens.rpartition(':')
    if is_loopback(address):
        return closed_to_others(host, 'localhost' if address == LOCAL else address, int(port))
    return unreachable(Address(host, int(port)), error, 'the cell for viewers') + (
        '' if address in ('0.0.0.0', host) else f' (it listens at {address}, its ROS_IP or '
        f'ROS_HOSTNAME; "cell view --master {address}" tries that)')


def no_cell(master_uri: str) -> str:
    """Return the message that there is a master without a cell."""
    return (f'there is a ROS master at {master_uri}, but no cell of this program that lets others '
            'watch: start it with "cell run --remote" or the launcher with remote:=true')


def nothing_there(address: Address, master: OSError, relay: OSError) -> Tuple[str, ...]:
    """Return the messages that neither a master nor a cell answers."""
    if isinstance(master, ConnectionRefusedError) and isinstance(relay, ConnectionRefusedError):
        return (f'nothing listens on {address.host}, neither a ROS master (port '
                f'{address.port or MASTER_PORT}) nor a cell for viewers (port '
                f'{DEFAULT_PORTS[0]}), or a firewall there refuses the connection: '
                'is the cell running there? It lets other computers watch if it is started with '
                '"cell run --remote" or the launcher with remote:=true. If it says another port '
                f'when it starts, add that: --master {bracketed(address.host)}:PORT',)
    # The port of the cell is the one that has to be open; that of the master may be closed.
    return (unreachable(Address(address.host, DEFAULT_PORTS[0]), relay, 'the cell for viewers'),)


def clocks_apart(ahead_s: float) -> Optional[str]:
    """Return the difference of the clocks, its effects and the remedy; None for a small one.

    ``ahead_s`` is the time by which the cell's clock is ahead of this one.
    """
    if abs(ahead_s) < CLOCKS_APART_S:
        return None
    return (f'the clocks are {_duration(abs(ahead_s))} apart: this one is '
            f'{"behind" if ahead_s > 0 else "ahead of"} that of the cell. The picture is right '
            'nevertheless, as everything in it has the stamps of the cell; but times of events '
            'and recordings are those of the cell, and nodes on both computers would not '
            'understand each other\'s transforms. Let both follow a time server: '
            '"sudo timedatectl set-ntp true"')


def versions_differ(theirs: str, ours: str) -> Optional[str]:
    """Return the message that the programs have different versions; None if they are the same."""
    if theirs == ours:
        return None
    return (f'the cell has version {theirs[:40]} of process_visualizer, this computer has {ours}: '
            'if something is missing in the picture, install the same version')


def types_differ(topics: Mapping[str, OfferedTopic], ours: Mapping[str, str]) -> Tuple[str, ...]:
    """Return messages on types with other definitions here; ``ours`` has the MD5 sums here."""
    found = {topic.type for topic in topics.values()
             if ours.get(topic.type) not in (None, topic.md5sum)}
    return tuple(f'{it} is another type here than at the cell: what is sent as such is not shown; '
                 f'install the same version of {it.partition("/")[0]}' for it in sorted(found))


def no_connection(name: str, since_s: float) -> str:
    """Return the message that the picture is out of date."""
    return f'no connection to {name} for {_duration(since_s)}: this picture is out of date'


def still_no_connection(name: str) -> str:
    """Return the advice while there is no connection for long."""
    return (f'still no connection: "cell view --check --master {name}" finds the reason. A cell '
            'that was started again may have another port, which it prints then')


def _duration(seconds: float) -> str:
    if seconds < 59.95:
        return f'{seconds:.1f} s'
    minutes, rest_s = divmod(round(seconds), 60)
    return f'{minutes} min {rest_s} s' if minutes < 60 else \
        f'{minutes // 60} h {minutes % 60} min'
