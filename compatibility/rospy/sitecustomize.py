# SPDX-License-Identifier: BSD-3-Clause
"""Lets the rospy and roslaunch of Debian 11 end without a traceback on its Python 3.9.

They call ``Thread.isAlive``, which Python 3.9 no longer has. Python imports this module when it
starts where the environment hook 50.rospy has put its folder on the path, which is there only.
"""
import threading

if not hasattr(threading.Thread, 'isAlive'):
    threading.Thread.isAlive = threading.Thread.is_alive  # type: ignore[attr-defined]
