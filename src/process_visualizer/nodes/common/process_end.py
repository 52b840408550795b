# SPDX-License-Identifier: BSD-3-Clause
"""Starts and ends the process of a rospy node; rospy alone does not always end it."""
from __future__ import annotations

import logging
import os
import signal
import sys
import threading
import time
from typing import Callable, List, NoReturn, Optional

import rospy

_SHUTDOWN_S = 1.2
"""For the whole shutdown, which includes unregistering at the master and at every node."""


def start_node(name: str, argv: Optional[List[str]] = None) -> None:
    """Make this process a node that SIGINT and SIGTERM shut down; end it if one comes already.

    To be called by the main thread, instead of ``rospy.init_node``. rospy's handlers shut down in
    the thread that the signal interrupts. If that thread is just asking the master, it holds the
    lock that unregistering needs, and waits for itself for ever.
    """
    received = threading.Event()

    def shut_down() -> None:
        received.wait()
        rospy.signal_shutdown('a signal')

    threading.Thread(target=shut_down, name='end at a signal', daemon=True).start()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: received.set())
    try:
        rospy.init_node(name, argv=argv, disable_signals=True)
    except rospy.ROSInitException:
        if not rospy.is_shutdown():
            raise
        end_process(0)


def at_shutdown(hook: Callable[[], None]) -> None:
    """Call a function once when the node shuts down, also if it is already doing so.

    rospy alone forgets a function that is given to it while it calls those given before.
    """
    uncalled = threading.Lock()

    def call() -> None:
        if uncalled.acquire(blocking=False):
            hook()

    rospy.on_shutdown(call)
    if rospy.is_shutdown():
        call()


def spin_to_end(*cleanups: Callable[[], None]) -> NoReturn:
    """Wait until ROS shuts the node down, then end its process with code 0.

    The cleanups are called at the shutdown. They and rospy have 1.2 s in all; then the process
    ends even if something hangs, for which roslaunch would wait 15 s.
    """
    begin = _limit(0)
    for hook in (begin, *cleanups):  # rospy calls them one after the other
        at_shutdown(hook)
    rospy.spin()
    end_process(0)


def end_process(code: int) -> NoReturn:
    """Shut the node down, if there is one, and end the process, after 1.2 s at most.

    rospy writes to each subscriber in a thread that is not a daemon. If the subscriber leaves
    while the node shuts down, that thread may never end, and the interpreter would wait for it for
    ever, ignoring SIGINT and SIGTERM.
    """
    _limit(code)()
    rospy.signal_shutdown('the program ends')
    logging.shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _limit(code: int) -> Callable[[], None]:
    """Return an event that starts the time after which the process ends with a code.

    The thread exists before the time starts, and only ends the process: the locks of logging
    and of a full pipe may be held by a thread that hangs.
    """
    begun = threading.Event()

    def end() -> None:
        begun.wait()
        time.sleep(_SHUTDOWN_S)
        os._exit(code)

    threading.Thread(target=end, name='limit of the shutdown', daemon=True).start()
    return begun.set
