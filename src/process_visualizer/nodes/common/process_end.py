# SPDX-License-Identifier: BSD-3-Clause
"""The end of a rospy node's process, which rospy alone does not always reach; and its beginning."""
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
"""For all that a shutdown does, which includes a farewell to the master and to every node."""


def start_node(name: str, argv: Optional[List[str]] = None) -> None:
    """Make this process a node that SIGINT and SIGTERM shut down; ends it if one comes meanwhile.

    To be called by the main thread, instead of ``rospy.init_node``. rospy's handlers shut down in
    the thread that the signal interrupts. If that is just asking the master, it holds the lock
    that the farewell needs, and waits for itself for ever.
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
    """Have a function called once when the node shuts down, also if it does so already.

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

    The cleanups are called at the shutdown. It has 1.2 s with all that they and rospy do;
    what hangs then is left: roslaunch would wait for it for 15 s.
    """
    begin = _limit(0)
    for hook in (begin, *cleanups):  # rospy calls them one after the other
        at_shutdown(hook)
    rospy.spin()
    end_process(0)


def end_process(code: int) -> NoReturn:
    """Shut the node down, if there is one, and end the process, after 1.2 s at most.

    rospy writes to each subscriber in a thread that is no daemon. If the subscriber leaves while
    the node shuts down, that thread may never be told to end, and the interpreter would wait for
    it for ever, with SIGINT and SIGTERM doing nothing.
    """
    _limit(code)()
    rospy.signal_shutdown('the program ends')
    logging.shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _limit(code: int) -> Callable[[], None]:
    """Return what begins the time after which the process ends with a code.

    The thread is there already when the time begins, and does nothing at its end but end the
    process: the locks of logging and of a full pipe may be held by what hangs.
    """
    begun = threading.Event()

    def end() -> None:
        begun.wait()
        time.sleep(_SHUTDOWN_S)
        os._exit(code)

    threading.Thread(target=end, name='limit of the shutdown', daemon=True).start()
    return begun.set
