"""The end of a rospy node's process, which rospy alone does not always reach."""
from __future__ import annotations

import logging
import os
import sys
import threading
from typing import NoReturn

import rospy

_SHUTDOWN_S = 1.2
"""For what a shutdown does, which includes a farewell to the master and to every node."""


def spin_to_end() -> NoReturn:
    """Wait until ROS shuts the node down, then end its process with code 0.

    A shutdown that hangs ends after 1.2 s: roslaunch would wait for it for 15 s.
    """
    rospy.on_shutdown(_limit_shutdown)
    rospy.spin()
    end_process(0)


def end_process(code: int) -> NoReturn:
    """Shut the node down, if there is one, and end the process at once.

    rospy writes to each subscriber in a thread that is no daemon. If the subscriber leaves while
    the node shuts down, that thread may never be told to end, and the interpreter would wait for
    it for ever, with SIGINT and SIGTERM doing nothing.
    """
    rospy.signal_shutdown('the program ends')
    _end_now(code)


def _limit_shutdown() -> None:
    timer = threading.Timer(_SHUTDOWN_S, _end_now, [0])
    timer.daemon = True
    timer.start()


def _end_now(code: int) -> NoReturn:
    logging.shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
