# SPDX-License-Identifier: BSD-3-Clause
"""Finds or starts the ROS master, and says why there is no usable one."""
from __future__ import annotations

import os
import shutil
import socket
import threading
from http.client import HTTPException
from typing import Optional
from urllib.parse import urlparse
from xmlrpc.client import Error as XmlRpcError

import rosgraph
import rospkg

from process_visualizer.launching.ros_api import PATIENT_TIMEOUT_S, process_id_at
from process_visualizer.launching.roslaunch_process import (
    RoslaunchProcess,
    is_for_this_computer,
    start_for_this_computer,
    start_roslaunch,
)
from process_visualizer.launching.run import LogTail, plain
from process_visualizer.launching.run_record import RunRecord, require_log_folder

_START_TIMEOUT_S = 60.0  # 30 s was too short at a load of 40
_STARTED = 'started core service [/rosout]'


class RosMasterError(Exception):
    """There is no usable ROS master; the text has the reason and the remedy."""


class RosMaster:
    """The master at ROS_MASTER_URI, or at another address.

    Call ``ensure`` from a thread that lives as long as the program: the kernel interrupts our own
    master when that thread ends.
    """

    def __init__(self, uri: Optional[str] = None,
                 start_timeout_s: float = _START_TIMEOUT_S) -> None:
        self._start_timeout_s = start_timeout_s
        self._uri = uri or rosgraph.get_master_uri()
        self._record = RunRecord()
        self._process: Optional[RoslaunchProcess] = None
        self._reader: Optional[threading.Thread] = None

    @property
    def uri(self) -> str:
        """The address of the master."""
        return self._uri

    def is_online(self) -> bool:
        """Return whether the master answers; takes at most 3 s."""
        return self.process_id() is not None

    def process_id(self) -> Optional[int]:
        """Return the master's process id, or None without an answer; takes at most 3 s."""
        try:
            return process_id_at(self._uri)
        except (OSError, HTTPException, XmlRpcError, ValueError):
            return None

    def check(self) -> None:
        """Raise RosMasterError unless a master answers or can be started; takes at most 3 s."""
        self._is_there()

    def ensure(self) -> bool:
        """Start a master if none is running; return True if the master is our own.

        Raises:
            RosMasterError: no master is running, and none can be started.
        """
        if not self._is_there():
            self.stop()  # remains of a master that has died
            self._start()
        return self._process is not None

    def stop(self) -> None:
        """Stop our own master, if there is one."""
        if self._process is None:
            return
        self._process.stop()
        if self._reader is not None:
            self._reader.join()
        self._process.output.close()
        self._record.remove()
        self._process = self._reader = None

    def _is_there(self) -> bool:
        """Return whether a master answers; False if nothing listens and one can be started."""
        host = self._host()
        try:
            process_id_at(self._uri)
            return True
        except (OSError, HTTPException, XmlRpcError, ValueError) as error:
            if not rosgraph.network.is_local_address(host):
                raise RosMasterError(self._remote(host, _reason(error))) from None
            if isinstance(error, ConnectionRefusedError):
                return False
        raise RosMasterError(
            f'something other than a ROS master listens at {self._uri}; stop it, or set '
            'ROS_MASTER_URI to another port')

    def _host(self) -> str:
        try:
            address = urlparse(self._uri)
            host, port = address.hostname, address.port
        except ValueError:
            host = port = None
        if not host or not port:
            raise RosMasterError(f'ROS_MASTER_URI is "{self._uri}"; it must look like '
                                 'http://localhost:11311')
        return host

    def _remote(self, host: str, reason: str) -> str:
        return (f'the ROS master at {self._uri} does not answer ({reason}); start roscore on '
                f'"{host}", or set ROS_MASTER_URI to http://localhost:11311')

    def _start(self) -> None:
        if shutil.which('roslaunch') is None:
            raise RosMasterError('roscore cannot be started: there is no roslaunch on PATH; load '
                                 "ROS's set-up file (source .../setup.bash)")
        try:
            require_log_folder()
            self._record.write()
            start = start_for_this_computer if is_for_this_computer(self._uri, os.environ) \
                else start_roslaunch
            port = urlparse(self._uri).port
            # An explicitly given file is removed at the end, unlike the default file of the same
            # name.
            pid_file = os.path.join(rospkg.get_ros_home(), f'roscore-{port}.pid')
            self._process = RoslaunchProcess(['--core', '-p', str(port), '--pid', pid_file],
                                             self._record.run_id, start)
        except OSError as error:
            self._record.remove()
            raise RosMasterError(f'roscore cannot be started: {error}') from None
        tail = LogTail()
        started = threading.Event()
        self._reader = threading.Thread(target=_read, args=[self._process, tail, started],
                                        name='read roscore', daemon=True)
        self._reader.start()
        is_in_time = started.wait(self._start_timeout_s)
        if not self.is_online():
            self.stop()
            if not is_in_time:
                raise RosMasterError(f'roscore at {self._uri} did not start within '
                                     f'{self._start_timeout_s:.0f} s: the computer is too busy; '
                                     'end other programs, and try again')
            raise RosMasterError(f'roscore cannot be started at {self._uri}: '
                                 + ' '.join(tail.lines()[-3:]))


def _read(process: RoslaunchProcess, tail: LogTail, started: threading.Event) -> None:
    """Read the output to its end; ``started`` is set when the master is up, or has failed."""
    for line in process.output:
        text = plain(line)
        tail.add(text)
        if _STARTED in text:
            started.set()
    started.set()


def _reason(error: Exception) -> str:
    if isinstance(error, socket.timeout):
        return f'no answer within {PATIENT_TIMEOUT_S:.0f} s'
    return getattr(error, 'strerror', None) or str(error) or type(error).__name__
