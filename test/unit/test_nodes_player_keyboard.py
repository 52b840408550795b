# SPDX-License-Identifier: BSD-3-Clause
"""The keyboard at a real terminal: keys, and everything that a shell does with a process."""
import gc
import os
import pty
import signal
import subprocess
import sys
import termios
from pathlib import Path

import pytest
from terminal_session import DEADLINE_S, TerminalSession

from process_visualizer.player.player_terminal import Keyboard

SOURCE = Path(__file__).resolve().parents[2] / 'src'
PLAYER = '''
import signal
import threading
from process_visualizer.player.player_terminal import Keyboard

def read(keyboard):
    for key in iter(keyboard.read_key, None):
        print(f"<{key}>", flush=True)
        if key == "q":
            break

signal.alarm(200)  # nothing is left behind by a test that failed
with Keyboard() as keyboard:
    signal.signal(signal.SIGINT, lambda *_: keyboard.stop())
    reader = threading.Thread(target=read, args=(keyboard,))
    reader.start()
    print("ready", flush=True)
    while reader.is_alive():
        reader.join(0.05)  # a signal just before a wait does not end it
print("left", flush=True)
'''


@pytest.fixture
def player(tmp_path):
    script = tmp_path / 'player.py'
    script.write_text(PLAYER)
    return [sys.executable, str(script)]


@pytest.fixture
def environment(tmp_path):
    return {'PATH': os.environ['PATH'], 'PYTHONPATH': str(SOURCE), 'PS1': 'prompt> ',
            'HOME': str(tmp_path), 'TERM': 'dumb', 'PYTHONDONTWRITEBYTECODE': '1'}


@pytest.fixture
def terminal(player, environment):
    with TerminalSession(player, environment) as session:
        session.expect(b'ready\r\n')
        yield session


@pytest.fixture(params=['dash -i', 'bash --norc --noprofile --noediting -i'])
def shell(request, environment):
    with TerminalSession(request.param.split(), environment) as session:
        session.expect(b'prompt> ')
        yield session


def start(shell, player, suffix=''):
    shell.type(f'{" ".join(player)} {suffix}\n'.encode())
    shell.expect(b'ready\r\n')


def suspend(shell):
    shell.type(b'\x1a')
    shell.expect(b'Stopped')
    shell.expect(b'prompt> ')


def test_keys_come_at_once_and_unechoed(terminal):
    for typed, shown in [(b' ', b'< >'), (b'\x1b[C', b'<right>'), (b'\x1bOH', b'<home>'),
                         (b'\x1b', b'<escape>'), (b'\xc3\xa9', b'<\xc3\xa9>')]:
        terminal.type(typed)
        assert terminal.expect(shown + b'\r\n') == b''
    assert not terminal.is_restored()


def test_pieces_of_a_sequence_are_one_key(terminal):
    terminal.type(b'\x1b[')
    terminal.type(b'1')
    terminal.type(b'~q')
    assert terminal.expect(b'left') == b'<home>\r\n<q>\r\n'


def test_terminal_is_restored_at_the_end(terminal):
    terminal.type(b'q')
    terminal.expect(b'left')
    assert terminal.wait() == 0
    assert terminal.is_restored()


def test_terminal_is_restored_after_ctrl_c(terminal):
    terminal.type(b'\x03')
    terminal.expect(b'left')
    assert terminal.wait() == 0
    assert terminal.is_restored()


def test_runs_on_where_nobody_could_continue_it(terminal):
    for _ in range(20):
        terminal.type(b'\x1a')  # does not stop an orphaned process group
        terminal.type(b'x')
        terminal.expect(b'<x>')
    terminal.type(b'q')
    terminal.expect(b'left')
    assert terminal.wait() == 0
    assert terminal.is_restored()


def test_stopped_and_continued_without_a_chance_to_restore(terminal):
    os.kill(terminal.process.pid, signal.SIGSTOP)
    os.waitpid(terminal.process.pid, os.WUNTRACED)
    os.kill(terminal.process.pid, signal.SIGCONT)
    terminal.type(b'xq')
    assert terminal.expect(b'left') == b'<x>\r\n<q>\r\n'
    assert terminal.wait() == 0
    assert terminal.is_restored()


def test_terminal_that_is_closed_ends_it(player, environment):
    with TerminalSession(player, environment) as session:
        session.expect(b'ready\r\n')
        session.hang_up()
        assert session.wait() == -signal.SIGHUP


def test_ctrl_z_and_foreground(shell, player):
    start(shell, player)
    suspend(shell)
    assert shell.is_restored()
    for _ in range(3):
        shell.type(b'fg\n')
        shell.type(b'x')
        shell.expect(b'<x>')
        assert not shell.is_restored()
        suspend(shell)
        assert shell.is_restored()
    shell.type(b'fg\n')
    shell.type(b'q')
    shell.expect(b'left')
    shell.expect(b'prompt> ')
    assert shell.is_restored()


def test_in_the_background_the_shell_has_the_terminal(shell, player):
    start(shell, player)
    suspend(shell)
    shell.type(b'bg\n')
    shell.type(b'echo x""y; jobs\n')
    shell.expect(b'xy\r\n')
    assert b'<' not in shell.expect(b'Running')
    assert shell.is_restored()
    shell.type(b'fg\n')
    shell.expect(b'player.py')
    shell.type(b'q')
    shell.expect(b'<q>')
    shell.expect(b'left')


def test_started_in_the_background(shell, player):
    start(shell, player, '&')
    shell.type(b'echo x""y; jobs\n')
    shell.expect(b'xy\r\n')
    assert b'<' not in shell.expect(b'Running')
    assert shell.is_restored()
    shell.type(b'fg\n')
    shell.expect(b'player.py')
    shell.type(b'q')
    shell.expect(b'<q>')
    shell.expect(b'left')
    shell.expect(b'prompt> ')
    assert shell.is_restored()


@pytest.mark.parametrize('round_number', range(5))
def test_ends_while_keys_come(terminal, round_number):
    terminal.type(b'x' * 50 * round_number + b'\x03' + b'y' * 200)
    terminal.expect(b'left')
    assert terminal.wait() == 0
    assert terminal.is_restored()


@pytest.mark.parametrize('stdin', [subprocess.PIPE, subprocess.DEVNULL])
def test_without_a_terminal_there_are_no_keys(player, environment, stdin):
    process = subprocess.Popen(player, stdin=stdin, stdout=subprocess.PIPE, env=environment)
    assert process.wait(DEADLINE_S) == 0  # although the pipe is still open
    assert process.stdout.read() == b'ready\nleft\n'
    process.stdout.close()
    if process.stdin:
        process.stdin.close()


@pytest.fixture
def foreign_terminal():
    master, terminal = pty.openpty()
    yield master, terminal
    os.close(terminal)
    os.close(master)


def test_terminal_of_another_session_is_left_alone(foreign_terminal):
    """It waits although there is input, and checks now and then whether it may read."""
    master, terminal = foreign_terminal
    before = termios.tcgetattr(terminal)
    os.write(master, b'typed\n')
    waits = []

    def wait(files, patience_ms):
        waits.append((terminal in files, patience_ms))
        if len(waits) == 3:
            keyboard.stop()
        return []

    with Keyboard(terminal, wait) as keyboard:
        assert termios.tcgetattr(terminal) == before
        assert keyboard.read_key() is None
        assert termios.tcgetattr(terminal) == before
    assert waits == 3 * [(False, 1000)]
    assert os.read(terminal, 100) == b'typed\n'


def test_signals_are_handled_as_before_at_the_end(foreign_terminal):
    numbers = [signal.SIGTSTP, signal.SIGCONT]
    before = [signal.getsignal(number) for number in numbers]
    with Keyboard(foreign_terminal[1]) as keyboard:
        assert [signal.getsignal(number) for number in numbers] != before
    assert [signal.getsignal(number) for number in numbers] == before
    assert keyboard.read_key() is None


def test_file_descriptors_are_closed(foreign_terminal):
    gc.collect()  # garbage of other tests
    before = os.listdir('/proc/self/fd')
    for _ in range(10):
        with Keyboard(foreign_terminal[1]) as keyboard:
            keyboard.stop()
    del keyboard
    gc.collect()
    assert len(os.listdir('/proc/self/fd')) == len(before)
