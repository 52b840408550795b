# SPDX-License-Identifier: BSD-3-Clause
"""Messages about obstacles between a viewer and a cell; addresses, ports, clocks."""
from __future__ import annotations

import errno
import socket
from typing import Dict, Optional, Tuple

import pytest

from process_visualizer.remote import link_words
from process_visualizer.remote.link_words import (
    Address,
    address_of,
    clocks_apart,
    hidden_from_others,
    how_to_watch,
    is_here,
    listening_address,
    no_connection,
    not_this_computer,
    nothing_there,
    only_small_packets,
    ports_of,
    relay_silent,
    types_differ,
    unknown_name,
    unnamed_here,
    unreachable,
    versions_differ,
)
from process_visualizer.remote.offer import OfferedTopic
from process_visualizer.viewing.relay_connection import ClockOffset

REFUSED = ConnectionRefusedError(errno.ECONNREFUSED, 'refused')


@pytest.mark.parametrize('text, address', [
    ('cell-pc', ('cell-pc', None)), ('10.0.0.1:5', ('10.0.0.1', 5)),
    ('http://cell:11311/', ('cell', 11311)), ('[fe80::1]:7', ('fe80::1', 7)),
    ('fe80::1%eth0', ('fe80::1%eth0', None)), ('fd00::2', ('fd00::2', None)),
    (' 10.0.0.1 ', ('10.0.0.1', None))])
def test_addresses(text: str, address: Tuple[str, 'int | None']) -> None:
    assert address_of(text) == address


@pytest.mark.parametrize('text', ['', ':11311', 'a:b', 'a:99999', 'a/b', 'http://', 'a:0'])
def test_what_is_no_address_is_told(text: str) -> None:
    with pytest.raises(ValueError, match='is not an address; write'):
        address_of(text)


def test_ports() -> None:
    assert ports_of('50000-50063') == range(50000, 50064)
    assert ports_of('7') == range(7, 8)
    for text in ('', 'a', '5-4', '0-3', '1-65536', '-5'):
        with pytest.raises(ValueError, match='is not a range of ports; write'):
            ports_of(text)


@pytest.mark.parametrize('environment, begin', [
    ({}, None), ({'ROS_IP': '127.0.0.1'}, None), ({'ROS_HOSTNAME': 'localhost'}, None),
    ({'ROS_IP': '192.0.2.7'}, 'ROS_IP is 192.0.2.7, which is not an address of this computer'),
    ({'ROS_HOSTNAME': 'no.such.name.invalid'}, 'ROS_HOSTNAME is no.such.name.invalid, which is')])
def test_an_address_of_another_computer_is_told(environment: Dict[str, str],
                                                begin: Optional[str]) -> None:
    found = not_this_computer(environment)
    assert found == begin if begin is None else str(found).startswith(begin)


@pytest.mark.parametrize('environment, is_remote, address', [
    ({}, False, '127.0.0.1'), ({}, True, '0.0.0.0'),
    ({'ROS_IP': '10.0.0.1'}, False, '10.0.0.1'), ({'ROS_IP': '10.0.0.1'}, True, '10.0.0.1'),
    ({'ROS_HOSTNAME': 'localhost'}, False, 'localhost'),
    ({'ROS_HOSTNAME': 'localhost'}, True, '0.0.0.0'), ({'ROS_IP': ' '}, False, '127.0.0.1')])
def test_where_the_relay_listens(environment: Dict[str, str], is_remote: bool,
                                 address: str) -> None:
    assert listening_address(environment, is_remote) == address


def test_each_obstacle_has_its_own_sentence() -> None:
    here = Address('cell', 11411)
    assert 'is not known' in unknown_name('cell')
    assert 'firewall' in unreachable(here, socket.timeout('timed out'), 'x')
    assert 'closed' in unreachable(here, REFUSED, 'x')
    without_network = unreachable(here, OSError(errno.ENETUNREACH, 'no route'), 'x')
    assert 'its own network is down' in without_network and 'firewall' not in without_network
    assert '--remote' in relay_silent('cell', '127.0.0.1:11411', REFUSED)
    assert 'ssh -N -L 11411:localhost:11411 cell' in relay_silent('cell', '127.0.0.1:11411',
                                                                  REFUSED)
    assert 'ssh -N -L 11411:127.0.1.1:11411 cell' in relay_silent('cell', '127.0.1.1:11411',
                                                                  REFUSED)
    assert 'its ROS_IP' in relay_silent('cell', '10.0.0.1:11411', REFUSED)
    assert 'ROS_IP' not in relay_silent('cell', '0.0.0.0:11411', REFUSED)
    assert 'is the cell running there?' in nothing_there(Address('cell', None), REFUSED,
                                                         REFUSED)[0]


def test_a_tunnel_whose_ssh_has_ended_is_told() -> None:
    told = unreachable(Address('localhost', 11411), REFUSED, 'x')
    assert 'its ssh has ended' in told and '--remote' not in told.replace('cell run --remote', '')
    assert 'tunnel' not in unreachable(Address('192.0.2.1', 11411), REFUSED, 'x')


@pytest.mark.parametrize('added', [True, False])
def test_localhost_is_here_also_without_ipv6(monkeypatch: pytest.MonkeyPatch, added: bool) -> None:
    usual = socket.getaddrinfo('127.0.0.1', 0, type=socket.SOCK_STREAM)
    nowhere = (socket.AF_INET, socket.SOCK_STREAM, 6, '', ('192.0.2.1', 0))
    monkeypatch.setattr(socket, 'getaddrinfo', lambda *_, **__: [nowhere, *usual * added])
    assert is_here('localhost') is added


@pytest.mark.parametrize('error', [ConnectionResetError(errno.ECONNRESET, 'Connection reset'),
                                   BrokenPipeError(errno.EPIPE, 'Broken pipe')])
def test_a_tunnel_into_nothing_is_told(error: OSError) -> None:
    assert 'If that is a tunnel, nothing listens at its other end' in unreachable(
        Address('localhost', 11411), error, 'x')
    assert 'another program listens there. Give the port of the cell' in unreachable(
        Address('192.0.2.1', 11411), error, 'x')


def test_who_answers_is_not_said_to_be_out_of_reach() -> None:
    there = Address('cell', 11411)
    assert unreachable(there, ConnectionError(0, 'it refuses: full'), 'x') == (
        'cell:11411 cannot be watched: it refuses: full')
    assert 'cannot be reached' in unreachable(there, OSError(errno.EACCES, 'denied'), 'x')


def test_a_host_name_that_leads_to_the_loopback_interface_hides_the_cell(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """Debian's own /etc/hosts has such a line."""
    monkeypatch.setattr(link_words, 'is_loopback', lambda host: host in ('cell-pc', '127.0.0.1'))
    assert 'ROS_HOSTNAME is cell-pc' in str(hidden_from_others({'ROS_HOSTNAME': 'cell-pc'}))
    assert 'ROS_IP is 127.0.0.1' in str(hidden_from_others({'ROS_IP': '127.0.0.1'}))
    for good in ({}, {'ROS_HOSTNAME': 'robot'}, {'ROS_HOSTNAME': 'localhost'},
                 {'ROS_HOSTNAME': 'cell-pc', 'ROS_IP': '10.0.0.5'}):
        assert hidden_from_others(good) is None


def test_how_others_watch() -> None:
    here = socket.gethostname()
    assert f'"cell view --master {here}" (port 11411 ' in how_to_watch('0.0.0.0:11411')
    assert '"cell view --master 10.0.0.5:50000" (port 50000 ' in how_to_watch('10.0.0.5:50000')


def test_computers_of_devices_have_to_find_this_one() -> None:
    assert 'set ROS_IP' in str(unnamed_here({}))
    assert unnamed_here({'ROS_IP': '10.0.0.5'}) is None


def test_the_command_for_small_packets_has_an_address() -> None:
    assert '"ip route get 127.0.0.1"' in only_small_packets('localhost')


def test_clocks() -> None:
    assert clocks_apart(0.3) is None
    assert 'the clocks are 1 h 0 min apart: this one is behind' in str(clocks_apart(3600.0))
    assert 'the clocks are 2.5 s apart: this one is ahead of' in str(clocks_apart(-2.5))


def test_the_quickest_answer_tells_the_time() -> None:
    clock = ClockOffset()
    clock.take(0, 3_500_000_000, 1_000_000_000)
    clock.take(2_000_000_000, 5_010_000_000, 2_020_000_000)
    assert clock.ahead_s == pytest.approx(3.0)
    assert clock.answer_s == pytest.approx(0.02)
    clock.take(9_000_000_000, 0, 8_000_000_000)  # set back in the meantime
    assert clock.ahead_s == pytest.approx(3.0)


def test_versions_and_types() -> None:
    assert versions_differ('1', '1') is None
    assert 'version 2 of process_visualizer, this computer has 1' in str(versions_differ('2', '1'))
    topics = {'/a': OfferedTopic('a/A', '1' * 32, ''), '/b': OfferedTopic('a/B', '2' * 32, '')}
    assert types_differ(topics, {'a/A': '1' * 32, 'a/B': '3' * 32}) == (
        'a/B is another type here than at the cell: what is sent as such is not shown; '
        'install the same version of a',)
    assert no_connection('cell', 12.04) == (
        'no connection to cell for 12.0 s: this picture is out of date')
