# SPDX-License-Identifier: BSD-3-Clause
"""Measures what the operator sees of each fault of a running cell, how soon, and what is left.

usage: bench/run faults [--only PART …]

A robot with its simulated driver, the recorder and RViz run, started by ``cell run`` and then by
the launcher (without its window). The program causes each fault, and waits for the message about
it and for the message that it is over. In the end everything is stopped; no process, file or node
may be left. It prints the table of docs/reliability.md. It ends with 1 if a message was missing,
or something was left.
"""
from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import threading
import time
import uuid
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import rospy
from rosgraph_msgs.msg import Log
from std_msgs.msg import Float32MultiArray, String

from process_visualizer.launching.ros_api import MasterClient, process_id_at
from process_visualizer.launching.ros_master import RosMaster

CONFIG = '''<visualizer>
  <device type="robot" name="ur_rt_upper">
    <model pkg="sewing_cell" path="urdf/ur_rt_upper.urdf.xacro" />
    <base frame="ur_rt_upper/link0" />
    <topic ns="ur_rt_upper" name="q_act" type="joint_states" />
    <topic ns="ur_rt_upper" name="tcf" type="tool_center_frame" />
  </device>
  <device type="other" name="driver">
    <base frame="driver/base" />
    <node ifstate="realtime" pkg="sewing_cell" type="simulator" name="simulator">
      <param name="image_rate" value="0" /><param name="force_rate" value="0" />
      <remap from="/driver/ur_rt_upper/q_act" to="/ur_rt_upper/q_act" />
      <remap from="/driver/ur_rt_upper/tcf" to="/ur_rt_upper/tcf" />
    </node>
  </device>
</visualizer>
'''
MARK = 'FAULTS_MARK'
WITHIN_S, START_S, END_S = 30.0, 120.0, 60.0
SILENT, OVER = 'is not responding', 'over after'
NODES = ('/cell_frames', '/scene_watch', '/ur_rt_upper/robot_proc', '/ur_rt_upper/joint_proc',
         '/ur_rt_upper/robot_state_publisher', '/driver/simulator', '/bag_recorder', '/rviz')
TITLES = {'/bag_recorder': 'Recorder', '/rviz': 'RViz'}
"""The operator's names of nodes; others are the last part of the node's name."""


class Line(NamedTuple):
    """A line that a program has written, and its time (monotonic) [s]."""

    time_s: float
    text: str


class Program:
    """A program that reports to the operator, line by line."""

    def __init__(self, name: str, command: Sequence[str], environment: Dict[str, str]) -> None:
        self.name = name
        self.process = subprocess.Popen(
            command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, errors='replace')
        self.lines: List[Line] = []
        self._changed = threading.Condition()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def wait(self, *parts: str, since: int = 0, within_s: float = WITHIN_S) -> Optional[Line]:
        """Wait for a line with all parts after the first ``since`` lines; None if none comes."""
        def found() -> Optional[Line]:
            return next((line for line in self.lines[since:]
                         if all(part in line.text for part in parts)), None)

        with self._changed:
            self._changed.wait_for(lambda: found() is not None, within_s)
            return found()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for text in self.process.stdout:
            with self._changed:
                self.lines.append(Line(time.monotonic(), text.rstrip()))
                self._changed.notify_all()


class Faults:
    """Causes faults in one run of the cell, and records the messages."""

    def __init__(self, name: str, command: Sequence[str], folder: Path) -> None:
        self.mark, self.folder = f'{MARK}={uuid.uuid4().hex}', folder
        self.temporary = folder / f'tmp_{name.replace(" ", "_")}'
        self.temporary.mkdir(parents=True)
        folder.chmod(0o700)  # required of XDG_RUNTIME_DIR
        key, value = self.mark.split('=')
        self.environment = {**os.environ, key: value, 'TMPDIR': str(self.temporary),
                            'XDG_RUNTIME_DIR': str(folder)}  # otherwise Qt would create one
        self.program = Program(name, command, self.environment)
        self.failures: List[str] = []

    def wait_until_up(self) -> None:
        """Wait until all nodes answer, and the watches have asked them."""
        end_s = time.monotonic() + START_S
        while any(process_of(node) is None for node in NODES):
            if time.monotonic() > end_s:
                missing = [node for node in NODES if process_of(node) is None]
                raise TimeoutError(f'{missing} not up: '
                                   + '\n'.join(it.text for it in self.program.lines[-30:]))
            time.sleep(0.2)
        time.sleep(5.0)

    def say(self, fault: str, words: Sequence[str], make: Callable[[], object],
            undo: Optional[Callable[[], object]] = None, over: Sequence[str] = ()) -> None:
        """Cause a fault; print the message about it, its delay, and when it is over."""
        since, begin_s = len(self.program.lines), time.monotonic()
        make()
        line = self.program.wait(*words, since=since)
        said = self._cell(line, begin_s, fault, words)
        ended = ''
        if undo is not None:
            since, begin_s = len(self.program.lines), time.monotonic()
            undo()
            if over:
                ended = self._cell(self.program.wait(*over, since=since), begin_s, fault, over)
        text = '' if line is None else line.text.strip()
        print(f'| {self.program.name} | {fault} | {said} | {ended} | {text} |', flush=True)

    def end(self, fault: str, make: Callable[[], object], code: Optional[int] = 0) -> None:
        """End the cell by a fault or a signal; print how long that takes, and what is left."""
        begin_s = time.monotonic()
        make()
        try:
            found = self.program.process.wait(END_S)
        except subprocess.TimeoutExpired:
            self.program.process.kill()
            found = None
        took_s = time.monotonic() - begin_s
        end_s = time.monotonic() + 10.0
        while self.processes() and time.monotonic() < end_s:
            time.sleep(0.1)
        log = '\n'.join(it.text for it in self.program.lines)  # kept if it has failed
        left = [it for it in self.left() if it not in log]
        if left or found is None or (code is not None and found != code):
            self.failures.append(f'{fault}: code {found}, left {left}')
        print(f'| {self.program.name} | {fault} | ends after {took_s:.1f} s with code {found} | '
              f'left: {left or "nothing"} | {self.program.lines[-1].text.strip()} |', flush=True)

    def processes(self) -> Dict[int, str]:
        """Return all processes that it has started, even if they were renamed."""
        found = {}
        for path in Path('/proc').iterdir():
            if not path.name.isdigit():
                continue
            with suppress(OSError):
                if self.mark.encode() in (path / 'environ').read_bytes().split(b'\0'):
                    found[int(path.name)] = (path / 'comm').read_text().strip()
        return found

    def left(self) -> List[str]:
        """Return what it has left: processes, folders, nodes of a master that still runs."""
        files = [str(it) for it in self.temporary.iterdir()]
        try:
            state = MasterClient('/faults').getSystemState()
        except OSError:
            state = []
        nodes = {node for part in state for _, names in part for node in names}
        return [*self.processes().values(), *files,
                *(node for node in nodes & set(NODES) if process_of(node) is not None)]

    def _cell(self, line: Optional[Line], begin_s: float, fault: str, words: Sequence[str]) -> str:
        if line is not None:
            return f'{line.time_s - begin_s:.1f} s'
        self.failures.append(f'{self.program.name}: {fault}: nothing with {words}')
        return 'never'


def process_of(node: str) -> Optional[int]:
    """Return the process id of a node that answers."""
    try:
        return process_id_at(MasterClient('/faults').lookupNode(node))
    except Exception:  # whatever is wrong with it, it does not answer
        return None


def title(node: str) -> str:
    """Return the operator's name of a node."""
    return TITLES.get(node, node.split('/')[-1])


class Drivers:
    """Drivers beside the simulator: this program publishes their topics."""

    def __init__(self) -> None:
        if not rospy.core.is_initialized():
            rospy.init_node('second_driver', disable_signals=True)
        self._ended = threading.Event()
        self._thread: Optional[threading.Thread] = None

    def begin(self, topic: str, message_class: Any, messages: Callable[[int], Any],
              rate_hz: float) -> None:
        """Publish until ``end``."""
        self._ended.clear()

        def publish() -> None:
            publisher = rospy.Publisher(topic, message_class, queue_size=1)
            count = 0
            while not self._ended.wait(1.0 / rate_hz):
                publisher.publish(messages(count))
                count += 1
            publisher.unregister()

        self._thread = threading.Thread(target=publish, daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Stop publishing."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()


class Beside(NamedTuple):
    """Programs that the cell does not start."""

    master: RosMaster
    drivers: Drivers


def node_faults(faults: Faults, _beside: Beside) -> None:
    """SIGSTOP and SIGCONT of every process in turn, and of both watches of the scene at once."""
    for node in NODES:
        pid = process_of(node)
        assert pid is not None, node
        faults.say(f'SIGSTOP {node}', (title(node), SILENT),
                   lambda pid=pid: os.kill(pid, signal.SIGSTOP),
                   lambda pid=pid: os.kill(pid, signal.SIGCONT), (title(node), SILENT, OVER))
    both = [pid for pid in map(process_of, ('/scene_watch', '/cell_frames')) if pid is not None]

    def all_of(number: int) -> None:
        for pid in both:
            os.kill(pid, number)

    faults.say('SIGSTOP scene_watch and cell_frames at once', ('cell_frames', SILENT),
               lambda: all_of(signal.SIGSTOP), lambda: all_of(signal.SIGCONT),
               ('cell_frames', SILENT, OVER))


def driver_faults(faults: Faults, beside: Beside) -> None:
    """Add a second driver, one of another type, garbage, and a flood of log messages."""
    drivers = beside.drivers

    def array(count: int) -> Float32MultiArray:
        return Float32MultiArray(data=[0.1 * (count % 7)] * 6)

    faults.say('a second driver on the topic of joints', ('nodes send positions',),
               lambda: drivers.begin('/ur_rt_upper/q_act', Float32MultiArray, array, 50.0),
               drivers.end)
    time.sleep(4.0)
    faults.say('a driver that sends another type', ('carries std_msgs/String',),
               lambda: drivers.begin('/ur_rt_upper/tcf', String, lambda _: String('x'), 20.0),
               drivers.end)
    time.sleep(4.0)
    faults.say('a driver that sends too few numbers', ('left out',),
               lambda: drivers.begin('/ur_rt_upper/tcf', Float32MultiArray,
                                     lambda _: Float32MultiArray(data=[1.0]), 20.0),
               drivers.end)
    ended = threading.Event()

    def flood() -> None:
        publisher, count = rospy.Publisher('/rosout', Log, queue_size=100), 0
        while not ended.is_set():
            publisher.publish(Log(level=Log.WARN, name='/second_driver', msg=f'line {count}'))
            count += 1
        publisher.unregister()

    thread = threading.Thread(target=flood, daemon=True)
    thread.start()
    time.sleep(3.0)
    pid = process_of('/bag_recorder')
    assert pid is not None
    faults.say('SIGSTOP /bag_recorder beside a node that floods /rosout', ('Recorder', SILENT),
               lambda: os.kill(pid, signal.SIGSTOP), lambda: os.kill(pid, signal.SIGCONT),
               ('Recorder', SILENT, OVER))
    ended.set()
    thread.join()


def master_faults(faults: Faults, beside: Beside) -> None:
    """Let a master hang, be killed, and be replaced by another one."""
    pid = beside.master.process_id()
    assert pid is not None
    faults.say('SIGSTOP of the master', ('ROS master', SILENT),
               lambda: os.kill(pid, signal.SIGSTOP), lambda: os.kill(pid, signal.SIGCONT),
               ('ROS master', OVER))
    faults.say('SIGKILL of the master', ('ROS master', SILENT),
               lambda: os.kill(pid, signal.SIGKILL))
    faults.say('a new roscore', ('ROS master', 'was restarted'), beside.master.ensure)


def kill_faults(faults: Faults, _beside: Beside) -> None:
    """SIGKILL of every process in turn."""
    for node in NODES:
        pid = process_of(node)
        words = (title(node) if 'launcher' in faults.program.name else node, 'killed')
        if pid is not None:
            faults.say(f'SIGKILL {node}', words, lambda pid=pid: os.kill(pid, signal.SIGKILL))


def cell_command(folder: Path) -> Tuple[str, List[str]]:
    """Return the name and the command of the cell without a window."""
    return 'cell run', ['rosrun', 'process_visualizer', 'cell', 'run', str(folder / 'cell.xml')]


def launcher_command(folder: Path) -> Tuple[str, List[str]]:
    """Return the name and the command of the launcher without its window."""
    program = Path(__file__).with_name('alarm_lines.py')
    return 'launcher', [sys.executable, '-u', str(program), str(folder / 'cell.xml')]


@contextmanager
def running(command: Tuple[str, List[str]], folder: Path, failures: List[str]) -> Iterator[Faults]:
    """A running cell."""
    faults = Faults(f'{command[0]}', command[1], folder / uuid.uuid4().hex)
    try:
        faults.wait_until_up()
        yield faults
    finally:
        failures += faults.failures
        for pid in faults.processes():
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


def stop(faults: Faults, number: int = signal.SIGINT) -> None:
    """Ask for the end, as the operator does."""
    stdin = faults.program.process.stdin
    assert stdin is not None
    stdin.close()
    if faults.program.name != 'launcher':
        for pid in faults.processes():
            with suppress(OSError):
                if b'cell\0run' in Path(f'/proc/{pid}/cmdline').read_bytes():
                    os.kill(pid, number)


def roslaunch_of(faults: Faults) -> List[int]:
    """Return the processes of roslaunch."""
    found = []
    for pid in faults.processes():
        with suppress(OSError):
            words = Path(f'/proc/{pid}/cmdline').read_bytes()
            if b'bin/roslaunch\0' in words and b'setpriv' not in words:
                found.append(pid)
    return found


FAULTS_OF_A_RUN = {'nodes': node_faults, 'drivers': driver_faults, 'kills': kill_faults,
                   'master': master_faults}
PARTS = (*FAULTS_OF_A_RUN, 'roslaunch', 'crash')


def main() -> int:
    """Cause all faults; return 1 if a message was missing, or something was left."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--only', nargs='*', choices=PARTS, default=PARTS)
    only = parser.parse_args().only
    folder = Path(os.environ['ROS_HOME']) / 'faults'
    folder.mkdir(parents=True)
    (folder / 'cell.xml').write_text(CONFIG)
    failures: List[str] = []
    print('| who says it | fault | said after | over after | words |\n|---|---|---|---|---|')
    for command in (cell_command(folder), launcher_command(folder)):
        master = RosMaster()
        master.ensure()
        beside = Beside(master, Drivers())
        for part, make in FAULTS_OF_A_RUN.items():
            if part in only:
                with running(command, folder, failures) as faults:
                    make(faults, beside)
                    faults.end(f'the end after {part}', partial(stop, faults), None)
        if 'roslaunch' in only and command[0] == 'cell run':
            _roslaunch_faults(command, folder, failures)
        master.stop()
        if 'crash' in only:
            _crash(command, folder, failures)
    print('\n'.join(['', *failures]) if failures else '\nall was said, and nothing was left')
    return 1 if failures else 0


def _roslaunch_faults(command: Tuple[str, List[str]], folder: Path, failures: List[str]) -> None:
    with running(command, folder, failures) as faults:
        faults.end('SIGKILL of roslaunch', lambda: [
            os.kill(pid, signal.SIGKILL) for pid in roslaunch_of(faults)], 1)
    with running(command, folder, failures) as faults:
        for pid in roslaunch_of(faults):
            os.kill(pid, signal.SIGSTOP)
        faults.end('Ctrl-C while roslaunch is stopped', lambda: stop(faults))
    with running(command, folder, failures) as faults:
        pid = process_of('/bag_recorder')
        if pid is not None:
            os.kill(pid, signal.SIGSTOP)
        faults.end('Ctrl-C while the recorder is stopped', lambda: stop(faults))


def _crash(command: Tuple[str, List[str]], folder: Path, failures: List[str]) -> None:
    """Kill the program itself; the next one removes what it has left."""
    master = RosMaster()
    master.ensure()
    with running(command, folder, failures) as faults:
        faults.program.process.kill()
        stop(faults, signal.SIGKILL)
        time.sleep(20.0)
        print(f'| {command[0]} | SIGKILL of itself | left after 20 s: '
              f'{[*faults.processes().values()] or "no process"}, {len(faults.left())} folders | '
              '| |', flush=True)
        left = list(faults.temporary.iterdir())
        with running(command, folder, failures) as second:
            swept = [it for it in left if not it.exists()]
            print(f'| {command[0]} | the next start | folders swept: {len(swept)} of {len(left)} '
                  '| | |', flush=True)
            if len(swept) < len(left):
                failures.append(f'{command[0]}: folders are left')
            second.end('the end after a crash', lambda: stop(second))
    master.stop()


if __name__ == '__main__':
    sys.exit(main())
