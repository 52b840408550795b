# SPDX-License-Identifier: BSD-3-Clause
"""A roslaunch that does not sleep through what it waits for; in a process of its own each."""
from __future__ import annotations

import subprocess
import sys

_BEGIN = '''
import subprocess, threading, time
from roslaunch import nodeprocess, pmon
from process_visualizer.launching.prompt_roslaunch import be_prompt
be_prompt()
begin_s = time.monotonic()
'''
_END = '''
print(time.monotonic() - begin_s)
'''


def took_s(what: str) -> float:
    """How long something takes that would be asleep for a minute [s]."""
    done = subprocess.run([sys.executable, '-c', _BEGIN + what + _END], check=True, timeout=50,
                          stdout=subprocess.PIPE, universal_newlines=True)
    return float(done.stdout)


def test_a_sleep_takes_as_long_as_it_is_told() -> None:
    assert took_s('nodeprocess.time.sleep(0.3)') >= 0.3


def test_the_end_of_a_process_ends_a_sleep() -> None:
    assert took_s('subprocess.Popen(["sleep", "0.5"]); nodeprocess.time.sleep(60)') >= 0.5


def test_it_does_so_in_every_thread() -> None:
    took_s('''
threads = [threading.Thread(target=nodeprocess.time.sleep, args=[60]) for _ in range(3)]
for it in threads: it.start()
subprocess.Popen(["sleep", "0.5"])
for it in threads: it.join()
''')


def test_a_monitor_that_is_shut_down_ends_a_sleep() -> None:
    took_s('''
threading.Timer(0.5, pmon.ProcessMonitor().shutdown).start()
pmon.time.sleep(60)
''')


def test_a_monitor_ends_although_its_signal_comes_during_a_sleep() -> None:
    """As Ctrl-C does: roslaunch's handler waits for the monitor in the main thread."""
    took_s('''
import os, signal
monitor = pmon.start_process_monitor()
pmon._init_signal_handlers()
threading.Timer(0.5, os.kill, [os.getpid(), signal.SIGINT]).start()
monitor.mainthread_spin()
''')
