# SPDX-License-Identifier: BSD-3-Clause
"""Tests a whole cell when disk, memory or processes are short, or the time of day is wrong.

usage: bench/run scarce [--only PART …] [--folder FOLDER] [--large-gb 20]

``cell run`` shows a simulated robot with RViz, ``cell record`` records it. Then the disk becomes
full, shrinks, or disappears; memory is short; there are no more processes and threads; the clock is
set; hundreds of topics do not answer. The table shows the messages of the two commands, and the
rate of transforms afterwards. ``large`` records a bag of that size, and measures what opens it.
Needs root, for disks of its own and memory groups; nothing remains, except that bag if
``--folder`` is given.
"""
from __future__ import annotations

import argparse
import mmap
import os
import resource
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Optional, Sequence, Union
from xmlrpc.client import ServerProxy

import numpy as np
import rospy
from faults import CONFIG, NODES, Faults, Program, process_of, stop
from players import OURS, playing
from rosgraph_msgs.msg import Log
from tf2_msgs.msg import TFMessage

from process_visualizer.launching.ros_api import MasterClient
from process_visualizer.launching.ros_master import RosMaster
from process_visualizer.msg import PlayerState
from process_visualizer.srv import Seek

WITHIN_S, QUIET_S = 60.0, 5.0
JOINTS, HOUR_S = '/ur_rt_upper/q_act', 3600
GROUPS = Path('/sys/fs/cgroup')


class Flow:
    """Counts transforms as a viewer receives them, and keeps the warnings of nodes."""

    def __init__(self) -> None:
        self.count, self.warnings = 0, []  # type: int, List[str]
        self._subscriptions = [
            rospy.Subscriber('/tf', TFMessage, self._take, queue_size=None),
            rospy.Subscriber('/rosout', Log, self._take_log, queue_size=None)]

    def rate_hz(self, seconds: float = 2.0) -> float:
        """Return the number of messages of /tf in the next second."""
        begin, begin_s = self.count, time.monotonic()
        threading.Event().wait(seconds)
        return (self.count - begin) / (time.monotonic() - begin_s)

    def close(self) -> None:
        """End the subscriptions."""
        for subscription in self._subscriptions:
            subscription.unregister()

    def _take(self, _message: TFMessage) -> None:
        self.count += 1

    def _take_log(self, message: Log) -> None:
        if message.level >= Log.WARN:
            self.warnings.append(f'{message.name}: {message.msg[:60]}')


class Bench:
    """A running cell, its recording, and its messages about faults."""

    def __init__(self, folder: Path, environment: Dict[str, str]) -> None:
        self.folder, self.failures = folder, []  # type: Path, List[str]
        self.groups = {it: Group(it) for it in ('memory', 'pids') if (GROUPS / it).is_dir()}
        os.environ.update(environment)
        command = ['rosrun', 'process_visualizer', 'cell', 'run', str(folder / 'cell.xml')]
        for group in self.groups.values():
            command = group.command(command)
        self.cell = Faults('cell run', command, folder / 'run')
        self.cell.wait_until_up()
        self.flow = Flow()

    def record(self, folder: Path, *options: str) -> Program:
        """Begin a recording of the robot's joints and poses."""
        program = Program('cell record', [
            'rosrun', 'process_visualizer', 'cell', 'record', str(self.folder / 'cell.xml'),
            '--folder', str(folder), *options], self.cell.environment)
        if program.wait('recording ', within_s=WITHIN_S) is None:
            self.failures.append(f'no recording: {[it.text for it in program.lines]}')
        return program

    def tell(self, what: str, programs: Sequence[Program], since: Sequence[int]) -> None:
        """Print a row: the messages, and the rate of transforms."""
        said = [line.text.strip() for program, begin in zip(programs, since)
                for line in program.lines[begin:] if line.text.strip()]
        print(f'| {what} | {"; ".join(dict.fromkeys(said)) or "nothing"} | '
              f'{self.flow.rate_hz():.0f} /tf a second |', flush=True)

    def close(self) -> None:
        """Stop the cell; remaining processes or files are a failure."""
        self.flow.close()
        self.cell.end('the end', lambda: stop(self.cell), None)
        self.failures += self.cell.failures
        for group in self.groups.values():
            group.close()


@contextmanager
def mounted(folder: Path, size_mb: int) -> Iterator[Path]:
    """Mount a disk of its own."""
    folder.mkdir(parents=True)
    subprocess.run(['mount', '-t', 'tmpfs', '-o', f'size={size_mb}m', 'tmpfs', str(folder)],
                   check=True)
    try:
        yield folder
    finally:
        subprocess.run(['umount', '-l', str(folder)], check=False, stderr=subprocess.DEVNULL)


def disk(bench: Bench) -> None:
    """Test a disk that becomes full, read-only, or is removed."""
    def fill(folder: Path) -> None:
        with open(folder / 'others', 'wb') as file:
            os.posix_fallocate(file.fileno(), 0, (1300 << 20) - (1023 << 20))

    def read_only(folder: Path) -> None:
        # A disk with open files is made read-only by its driver after an error, not by a command.
        subprocess.run(['mount', '-o', 'remount,size=1m', str(folder)], check=False)

    def gone(folder: Path) -> None:
        for path in folder.iterdir():
            path.unlink()
        subprocess.run(['umount', '-l', str(folder)], check=True)

    for what, make in (('the disk gets full', fill), ('the disk shrinks to nothing', read_only),
                       ('the disk is taken away, its files removed', gone)):
        with mounted(bench.folder / f'disk{len(what)}', 1300) as folder:
            program = bench.record(folder)
            threading.Event().wait(3.0)
            since = [len(bench.cell.program.lines), len(program.lines)]
            begin_s = time.monotonic()
            make(folder)
            ended = _ends(program, 20.0)
            bench.tell(f'{what}; recording {_end_words(program, ended, begin_s)}',
                       (bench.cell.program, program), since)
            _stop_recording(program)


def memory(bench: Bench) -> None:
    """Allow each process no more memory for a while; then all together."""
    for node in NODES:
        pid = process_of(node)
        if pid is None:
            bench.failures.append(f'{node} does not answer')
            continue
        since = [len(bench.cell.program.lines)]
        size = next(int(line.split()[1]) << 10 for line in
                    Path(f'/proc/{pid}/status').read_text().splitlines()
                    if line.startswith('VmSize'))
        resource.prlimit(pid, resource.RLIMIT_AS, (size, resource.RLIM_INFINITY))
        threading.Event().wait(QUIET_S)
        bench.tell(f'no more memory for {node}', (bench.cell.program,), since)
        since = [len(bench.cell.program.lines)]
        if Path(f'/proc/{pid}').exists():
            resource.prlimit(pid, resource.RLIMIT_AS,
                             (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        threading.Event().wait(QUIET_S)
        bench.tell('memory again', (bench.cell.program,), since)
        if process_of(node) is None:
            print(f'| {node} does not come back by itself | | |')
    group = bench.groups.get('memory')
    if group is None:
        print('| all together have no more memory | no memory groups here | |')
        return
    since = [len(bench.cell.program.lines)]
    program = bench.record(bench.folder / 'short')
    _limit_to_used(group)
    threading.Event().wait(4 * QUIET_S)
    bench.tell('all together have no more memory', (bench.cell.program, program), [*since, 0])
    group.set('memory.limit_in_bytes', -1)
    _stop_recording(program)


def _limit_to_used(group: 'Group') -> None:
    """Allow no more memory than what is in use and cannot be written to files."""
    while True:
        used = group.number('memory.usage_in_bytes')
        try:
            group.set('memory.limit_in_bytes', used - (2 << 20))
        except OSError:  # the kernel found nothing more to take back
            print(f'{used >> 20} MB are in use', file=sys.stderr)
            return


def threads(bench: Bench) -> None:
    """Let no process of the cell start another thread or process, as with ``ulimit -u``."""
    group = bench.groups.get('pids')
    if group is None:
        print('| no more threads | no groups for processes here | |')
        return
    since, warned = [len(bench.cell.program.lines)], len(bench.flow.warnings)
    group.set('pids.max', group.number('pids.current'))
    recording = bench.record(bench.folder / 'few')
    peers = [_silent_peer(node) for node in NODES]
    threading.Event().wait(4 * QUIET_S)
    bench.tell('no more threads and processes for the cell', (bench.cell.program, recording),
               [*since, 0])
    print(*sorted(set(bench.flow.warnings[warned:])), sep='\n', file=sys.stderr)
    group.set('pids.max', 'max')
    for peer in filter(None, peers):
        peer.close()
    since = [len(bench.cell.program.lines), len(recording.lines)]
    threading.Event().wait(QUIET_S)
    bench.tell('threads again', (bench.cell.program, recording), since)
    _stop_recording(recording)
    recording = bench.record(bench.folder / 'after')
    threading.Event().wait(QUIET_S)
    bench.tell('another recording', (recording,), [0])
    _stop_recording(recording)
    for node in NODES:
        if process_of(node) is None:
            print(f'| {node} does not come back by itself | | |')


def _silent_peer(node: str) -> Optional[socket.socket]:
    """Connect to a node like a subscriber that says nothing yet: the node needs a thread for it."""
    try:
        uri = MasterClient('/scarce').lookupNode(node)
        _, _, (_, host, port) = ServerProxy(uri).requestTopic('/scarce', '/rosout', [['TCPROS']])
        return socket.create_connection((host, port), 5.0)
    except (OSError, ValueError, TypeError):
        return None


class Group:
    """A control group (version 1) of a controller, for processes that are started in it."""

    def __init__(self, controller: str) -> None:
        self._top = GROUPS / controller
        self._path = self._top / f'scarce{os.getpid()}'
        self._path.mkdir()

    def command(self, words: Sequence[str]) -> List[str]:
        """Return a command that runs another one in the group."""
        return ['sh', '-c', 'echo $$ > "$0" && exec "$@"', str(self._path / 'cgroup.procs'),
                *words]

    def number(self, name: str) -> int:
        """Return the content of a file of the group."""
        return int((self._path / name).read_text())

    def set(self, name: str, value: Union[int, str]) -> None:
        """Write into a file of the group."""
        (self._path / name).write_text(str(value))

    def close(self) -> None:
        """Remove the group; its processes have ended."""
        for pid in (self._path / 'cgroup.procs').read_text().split():
            (self._top / 'cgroup.procs').write_text(pid)
        self._path.rmdir()


def clock(bench: Bench) -> None:
    """Set the computer's clock an hour ahead and back, while the cell is recorded."""
    program = bench.record(bench.folder / 'bags')
    for what, offset_s in (('an hour forth', HOUR_S), ('and back', 0), ('an hour back', -HOUR_S),
                           ('and forth', 0), ('3 s forth', 3), ('and back', 0)):
        since = [len(bench.cell.program.lines), len(program.lines)]
        warned = len(bench.flow.warnings)
        SetClock.shared().set(offset_s)
        threading.Event().wait(QUIET_S)
        bench.tell(f'the clock is set {what}', (bench.cell.program, program), since)
        print(*sorted(set(bench.flow.warnings[warned:])), sep='\n', file=sys.stderr)
    since = [len(program.lines)]
    _stop_recording(program)
    print('\n'.join(line.text for line in program.lines[since[0]:]))


def topics(bench: Bench) -> None:
    """Let a node with 500 topics hang while all topics are recorded."""
    publisher = subprocess.Popen([sys.executable, '-c', _MANY_TOPICS], stdout=subprocess.PIPE)
    assert publisher.stdout is not None
    publisher.stdout.readline()
    publisher.send_signal(signal.SIGSTOP)
    try:
        since = len(bench.cell.program.lines)
        program = Program('cell record', [
            'rosrun', 'process_visualizer', 'cell', 'record', '-a', '--folder',
            str(bench.folder / 'many')], bench.cell.environment)
        program.wait('not recording', within_s=30.0)
        bench.tell('500 topics of a node that hangs are to be recorded',
                   (bench.cell.program, program), [since, 0])
        _stop_recording(program)
    finally:
        publisher.kill()
        publisher.wait()


def large(bench: Bench, folder: Path, gigabytes: float) -> None:
    """Record, report, play and cut a bag of many gigabytes."""
    bag = folder / 'large.bag'
    publisher = subprocess.Popen([sys.executable, '-c', _LARGE_MESSAGES], stdout=subprocess.PIPE)
    assert publisher.stdout is not None
    publisher.stdout.readline()
    try:
        begin_s = time.monotonic()
        program = bench.record(folder, '-O', 'large', '/large', '--size', f'{gigabytes * 1000:.0f}')
        rate_hz = bench.flow.rate_hz(10.0)
        program.process.wait(3600.0)
        print(f'recorded in {time.monotonic() - begin_s:.0f} s, {rate_hz:.0f} /tf a second')
        print('\n'.join(line.text for line in program.lines))
    finally:
        publisher.kill()
        publisher.wait()
    cell = ['rosrun', 'process_visualizer', 'cell']
    for command in (['report', str(bag)], ['runs', str(bag)],
                    ['cut', str(bag), '--from', '1:00', '--to', '1:05', '-o',
                     str(folder / 'cut.bag')]):
        _print_effort(command[0], [*cell, *command])
    _print_seeks(bag)


def _print_effort(name: str, command: Sequence[str]) -> None:
    """Print the duration of a command, and the largest memory of its processes."""
    begin_s = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert process.stdout is not None
    text = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    print(f'cell {name}: {time.monotonic() - begin_s:.1f} s, {usage.ru_maxrss >> 10} MB, '
          f'status {status}, {text.strip().splitlines()[-1:]}', flush=True)


def _print_seeks(bag: Path, count: int = 50) -> None:
    """Print the time of seeks of the player until the joints of the position arrive."""
    arrived = threading.Event()
    subscription = rospy.Subscriber(JOINTS, rospy.AnyMsg, lambda _: arrived.set())
    begin_s = time.monotonic()
    with playing(OURS, bag, ['--pause', '-k']) as process:
        rospy.wait_for_service('/bag_player/seek', WITHIN_S)
        seek = rospy.ServiceProxy('/bag_player/seek', Seek)
        seek(0.0)
        arrived.wait(WITHIN_S)
        opened_s = time.monotonic() - begin_s
        length_s = rospy.wait_for_message('/bag_player/state', PlayerState, WITHIN_S).duration
        took_ms = []
        for position_s in np.random.default_rng(1).uniform(0.0, length_s, count):
            arrived.clear()
            begin_s = time.monotonic()
            seek(float(position_s))
            arrived.wait(WITHIN_S)
            took_ms.append(1e3 * (time.monotonic() - begin_s))
        memory = next(line for line in Path(f'/proc/{_player_of(process.pid)}/status')
                      .read_text().splitlines() if line.startswith('VmHWM'))
    subscription.unregister()
    print(f'player: {opened_s:.1f} s to the first joints, {memory}; {count} seeks in '
          f'{length_s:.0f} s: p50 {np.percentile(took_ms, 50):.0f}, p95 '
          f'{np.percentile(took_ms, 95):.0f}, at most {max(took_ms):.0f} ms', flush=True)


def _player_of(pid: int) -> int:
    """Return the process that rosrun has become or started."""
    children = Path(f'/proc/{pid}/task/{pid}/children').read_text().split()
    return _player_of(int(children[0])) if children else pid


class SetClock:
    """The clock offset of all programs that are started from here."""

    _only: Optional['SetClock'] = None

    def __init__(self, folder: Path) -> None:
        path, library = folder / 'clock', folder / 'set_clock.so'
        path.write_bytes(struct.pack('q', 0))
        with open(path, 'r+b') as file:
            self._bytes = mmap.mmap(file.fileno(), 8)
        subprocess.run(['cc', '-shared', '-fPIC', '-O1', '-o', str(library),
                        str(Path(__file__).with_name('set_clock.c')), '-ldl'], check=True)
        self.environment = {'LD_PRELOAD': str(library), 'SET_CLOCK_FILE': str(path)}
        SetClock._only = self

    @staticmethod
    def shared() -> 'SetClock':
        """Return the clock of the running cell."""
        assert SetClock._only is not None
        return SetClock._only

    def set(self, offset_s: int) -> None:
        """Set the clock ahead by this much."""
        self._bytes[:] = struct.pack('q', offset_s)


def _ends(program: Program, within_s: float) -> Optional[int]:
    try:
        return program.process.wait(within_s)
    except subprocess.TimeoutExpired:
        return None


def _end_words(program: Program, code: Optional[int], begin_s: float) -> str:
    if code is None:
        return 'goes on'
    return f'ends with code {code}, {program.lines[-1].time_s - begin_s:.1f} s later'


def _stop_recording(program: Program) -> None:
    if program.process.poll() is None:
        program.process.send_signal(signal.SIGINT)
        try:
            program.process.wait(WITHIN_S)
        except subprocess.TimeoutExpired:
            program.process.kill()


_MANY_TOPICS = '''
import rospy, std_msgs.msg
rospy.init_node('many')
publishers = [rospy.Publisher(f'/many/topic{i}', std_msgs.msg.String, queue_size=1)
              for i in range(500)]
print('up', flush=True)
rospy.spin()
'''
_LARGE_MESSAGES = '''
import os, rospy, std_msgs.msg
rospy.init_node('large')
class Bytes(std_msgs.msg.ByteMultiArray):
    def serialize(self, buffer):
        buffer.write(bytes(8) + len(data).to_bytes(4, 'little') + data)
data = os.urandom(4 << 20)
publisher = rospy.Publisher('/large', Bytes, queue_size=1)
print('up', flush=True)
rate = rospy.Rate(12)
while not rospy.is_shutdown():
    publisher.publish(Bytes())
    rate.sleep()
'''
PARTS: Dict[str, Callable[[Bench], None]] = {
    'disk': disk, 'memory': memory, 'threads': threads, 'clock': clock, 'topics': topics}


def main() -> int:
    """Run the parts; return 1 if something failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--only', nargs='*', choices=(*PARTS, 'large'), default=tuple(PARTS))
    parser.add_argument('--folder', type=Path)
    parser.add_argument('--large-gb', type=float, default=20.0)
    values = parser.parse_args()
    home = Path(os.environ['ROS_HOME']) / 'scarce'
    home.mkdir(parents=True)
    failures: List[str] = []
    print('| what happens | what is said | what goes on |\n|---|---|---|')
    for part in values.only:
        folder = home / part
        folder.mkdir()
        (folder / 'cell.xml').write_text(CONFIG)
        environment = SetClock(folder).environment if part == 'clock' else {}
        os.environ.update(environment)
        master = RosMaster()
        master.ensure()
        for name in environment:
            del os.environ[name]
        if not rospy.core.is_initialized():
            rospy.init_node('scarce', disable_signals=True)
        bench = Bench(folder, environment)
        try:
            if part == 'large':
                large(bench, values.folder or folder, values.large_gb)
            else:
                PARTS[part](bench)
        finally:
            bench.close()
            for name in environment:
                del os.environ[name]
            master.stop()
        failures += bench.failures
    print('\n'.join(['', *failures]) if failures else '\nnothing was left')
    return 1 if failures else 0


if __name__ == '__main__':
    sys.exit(main())
