# SPDX-License-Identifier: BSD-3-Clause
"""Commands that show a running cell elsewhere: ``cell view`` (RViz), ``cell serve`` (browsers)."""
from __future__ import annotations

import argparse
import contextlib
import errno
import json
import os
import secrets
import shutil
import signal
import socket
import ssl
import sys
from functools import partial
from typing import Callable, Dict, Iterator, List, Optional, Tuple

import rosgraph
from rosgraph.network import get_local_addresses

from process_visualizer.cell.model import Cell
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.interrupts import StopRequested, StopSignals
from process_visualizer.launching.ros_api import is_registered
from process_visualizer.launching.ros_master import RosMaster
from process_visualizer.launching.run_record import (
    RunRecord,
    clean_up_crashed_runs,
)
from process_visualizer.launching.x_display import require_display
from process_visualizer.page.html_page import GHOST_STYLE, live_html, web_file
from process_visualizer.page.live_feed import Admission
from process_visualizer.page.packed import Packed
from process_visualizer.page.run_page import PageCell
from process_visualizer.remote.link_words import Address, address_of
from process_visualizer.shown_text import say
from process_visualizer.viewing.find_relay import CellNotFound, find_relay

_VIEW_NODE = 'cell_view'


def add_view_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell view``."""
    command.add_argument('--master', metavar='HOST', type=_address, default=None,
                         help='the computer on which the cell runs, or HOST:PORT (default: that of '
                              'ROS_MASTER_URI)')
    command.add_argument('--check', action='store_true',
                         help='only check whether the cell can be watched, and report obstacles')
    command.add_argument('--no-rviz', action='store_true',
                         help='without RViz: topics and models for other programs, on a ROS master '
                              'of its own, which is printed')


def execute_view(options: argparse.Namespace) -> int:
    """Show the cell until RViz is closed or Ctrl-C is pressed; return the exit code.

    Raises:
        RosMasterError, OSError: RViz cannot be started.
    """
    if not (options.check or options.no_rviz):
        require_display('; or add --no-rviz')
    wanted = options.master or address_of(rosgraph.get_master_uri())
    say(f'looking for a cell on {wanted}')  # the answer may take seconds
    try:
        address = find_relay(wanted)
    except CellNotFound as error:
        for problem in error.problems:
            say(f'cell: {problem}', file=sys.stderr)
        return 1
    if options.check:
        say(f'the cell on {address[0]} can be watched (port {address[1]})')
        return 0
    clean_up_crashed_runs()
    try:
        with StopSignals() as signals, signals.raised(), _own_master() as uri:
            if options.no_rviz:
                say(f'ROS_MASTER_URI={uri}')
            return _show(wanted, address, not options.no_rviz)
    except StopRequested:
        return 0


def _address(text: str) -> Address:
    try:
        return address_of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _show(wanted: Address, address: Tuple[str, int], with_rviz: bool) -> int:
    import rospy  # imported late: it reads the address of its master

    from process_visualizer.nodes.common.node_server import answer_patiently, serve_patiently
    from process_visualizer.viewing.viewer import Viewer
    serve_patiently()
    rospy.init_node(_VIEW_NODE, anonymous=True, disable_signals=True, argv=[])
    answer_patiently()
    record = RunRecord()
    folder = record.begin()
    viewer = Viewer(str(wanted), address, partial(find_relay, wanted), folder, say, with_rviz)
    try:
        return viewer.run()
    except StopRequested:
        say('ending')
        return 0
    finally:
        viewer.close()
        rospy.signal_shutdown('the viewer ends')
        shutil.rmtree(folder, ignore_errors=True)
        record.remove()


@contextlib.contextmanager
def _own_master() -> Iterator[str]:
    """Run a ROS master for this computer only; this process uses it from now on."""
    with contextlib.closing(socket.socket()) as probe:
        probe.bind(('localhost', 0))
        port = probe.getsockname()[1]
    own: Dict[str, str] = {'ROS_MASTER_URI': f'http://localhost:{port}',
                           'ROS_HOSTNAME': 'localhost'}
    os.environ.pop('ROS_IP', None)  # the viewer's nodes are for this computer only
    os.environ.update(own)
    master = RosMaster()
    try:
        master.ensure()
        yield master.uri
    finally:
        master.stop()


PORT = 11480
_HOME = '127.0.0.1'
_TOKEN_BYTES = 24
_SERVE_NODE = 'cell_serve'
_EVERYWHERE = ('', '0.0.0.0', '::')
_LAST_PORT = 65_535


def add_serve_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell serve``."""
    command.add_argument('config', metavar='CONFIG', help='the configuration of the running cell')
    command.add_argument('--address', metavar='ADDRESS',
                         help='of this computer, at which others can open the page; 0.0.0.0: all '
                              f'(default: {_HOME}, for this computer only)')
    command.add_argument('--port', type=_port, default=PORT, help=f'(default: {PORT})')
    command.add_argument('--certificate', metavar='FILE', help='for https, in PEM')
    command.add_argument('--key', metavar='FILE', help='of the certificate, if it is not in it')


def _port(text: str) -> int:
    if not text.isdecimal() or not 0 < int(text) <= _LAST_PORT:
        raise argparse.ArgumentTypeError(f'a port is a number from 1 to {_LAST_PORT}, not {text}')
    return int(text)


def execute_serve(options: argparse.Namespace, arguments: Dict[str, str]) -> int:
    """Show the running cell until Ctrl-C; return 0.

    Raises:
        ConfigurationError: the configuration is invalid.
        ValueError: no cell is running, or an option is invalid.
        OSError: the page cannot be served at the address, or a file cannot be read.
    """
    cell = XmlParser(arguments).parse(options.config)
    context = _tls(options.certificate, options.key)
    _check_that_it_runs(options.config)
    _serve(cell, options.address, options.port, context)
    return 0


def _check_that_it_runs(config: str) -> None:
    from process_visualizer.serving.cell_link import CELL_NODES
    if not any(is_registered(name) for name in CELL_NODES):
        raise ValueError(f'no cell is running on the ROS master {rosgraph.get_master_uri()}; start '
                         f'it with "cell run {config}" or the launcher, then this command')


def _tls(certificate: Optional[str], key: Optional[str]) -> Optional[ssl.SSLContext]:
    if certificate is None:
        if key is not None:
            raise ValueError('--key needs the --certificate that it belongs to')
        return None
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(certificate, key, password=lambda: '')
    except ssl.SSLError as error:
        raise ValueError(f'{certificate} and {key or "the key in it"} are not a matching '
                         f'certificate and key in PEM ({error.reason or error}); a key must not '
                         'have a password') from None
    except OSError as error:
        raise OSError(error.errno, f'{certificate if key is None else f"{certificate} or {key}"}: '
                                   f'{error.strerror}') from None
    return context


def _serve(cell: Cell, address: Optional[str], port: int,
           context: Optional[ssl.SSLContext]) -> None:
    import rospy  # imported late, like tornado: other commands do not need them
    from tornado.ioloop import IOLoop

    from process_visualizer.nodes.common.node_server import answer_patiently, serve_patiently
    from process_visualizer.serving.cell_link import CellLink, PageClock
    from process_visualizer.serving.live_cell import PERIOD_S, LiveCell
    from process_visualizer.serving.web_server import LiveServer, Ticks, served_file
    packed, server = Packed(), secrets.token_hex(8)
    shared = PageCell(cell, packed)
    live = LiveCell(cell, shared, server)
    model = {'meshes': shared.meshes, 'ghost': GHOST_STYLE, 'server': server,
             'columns': packed.text()}
    title = os.path.splitext(os.path.basename(cell.file))[0]
    files = {
        '': served_file('text/html; charset=utf-8', live_html(title, shared.notes)),
        'page.js': served_file('text/javascript; charset=utf-8', web_file('page.js')),
        'page.css': served_file('text/css; charset=utf-8', web_file('page.css')),
        'model': served_file('application/json', json.dumps(model, separators=(',', ':')))}
    admission = Admission('' if address is None else secrets.token_urlsafe(_TOKEN_BYTES))
    loop = IOLoop.current()

    def report(text: str) -> None:
        try:
            say(text)
        except BrokenPipeError:  # the window that started this process has ended
            loop.stop()

    web = LiveServer(files, live.feed, admission, live.recent, report)
    _listen(web, _HOME if address is None else address, port, context)
    clock = PageClock()
    try:
        serve_patiently()
        rospy.init_node(_SERVE_NODE, anonymous=True, disable_signals=True, argv=[])
        answer_patiently()
        link = CellLink(live, cell.devices, clock)
    except (rospy.ROSException, rosgraph.MasterException) as error:
        raise ValueError(f'the ROS master at {rosgraph.get_master_uri()} has refused the page '
                         f'({error}); restart "cell serve"') from None

    def tick() -> None:
        live.wants_clouds = web.has_clouds
        live.tick(clock.now_s(), clock.steady_s(), len(web.viewers))
        web.send()

    ticks = Ticks(loop, tick, PERIOD_S)
    stop_at_signals(lambda: loop.add_callback_from_signal(loop.stop))
    ticks.start()
    for url in _urls(address, port, context is not None, admission.path()):
        say(url)
    if address is not None and context is None:
        say('note: without --certificate the page is not encrypted: anyone who can listen on the '
            'network sees it and its token', file=sys.stderr)
    try:
        loop.start()
    finally:
        ticks.stop()
        web.close()
        link.close()
        rospy.signal_shutdown('the page is closed')


def stop_at_signals(stop: Callable[[], object]) -> None:
    """Call a function at each signal that ends a command, also a hangup unless nohup ignores it."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if number is not signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, lambda *_: stop())


def _listen(web: 'object', address: str, port: int, context: Optional[ssl.SSLContext]) -> None:
    try:
        web.listen(address, port, context)  # type: ignore[attr-defined]
    except OSError as error:
        reasons = {errno.EADDRINUSE: f'another program has port {port}; choose another --port',
                   errno.EADDRNOTAVAIL: 'that is not an address of this computer',
                   errno.EACCES: 'ports below 1024 are for root; choose another --port'}
        raise OSError(error.errno, f'the page cannot be served at {address}: '
                      f'{reasons.get(error.errno or 0, error.strerror or error)}') from None


def _urls(address: Optional[str], port: int, is_encrypted: bool, path: str) -> List[str]:
    """Return the addresses at which the page can be opened."""
    hosts = [_HOME] if address is None else [address]
    if address in _EVERYWHERE:
        hosts = [it for it in get_local_addresses() if not it.startswith('127.')] or [_HOME]
    kind = 'https' if is_encrypted else 'http'
    return [f'{kind}://{f"[{it}]" if ":" in it else it}:{port}{path}' for it in hosts]
