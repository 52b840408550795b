# SPDX-License-Identifier: BSD-3-Clause
"""Functions to be called when a node ends, registered while it ends; in a separate process."""
from __future__ import annotations

import subprocess
import sys

ENDS = """
import threading
import rospy
from process_visualizer.nodes.common.node_handle import at_shutdown

given, called = [], []

def give_another():
    given.append(threading.Thread(target=at_shutdown, args=[lambda: called.append('meanwhile')]))
    given[0].start()
    given[0].join(0.2)  # it waits for rospy, which has begun to call what it was given

at_shutdown(lambda: called.append('before'))
at_shutdown(give_another)
rospy.signal_shutdown('the test')
given[0].join()
at_shutdown(lambda: called.append('after'))
print(*called)
"""


def test_nothing_is_forgotten_that_is_to_be_done_at_the_end() -> None:
    """Otherwise a player that receives a signal while it starts would wait forever."""
    ended = subprocess.run([sys.executable, '-c', ENDS], stdout=subprocess.PIPE, text=True,
                           check=True, timeout=60)
    assert ended.stdout.split() == ['before', 'meanwhile', 'after']

ENDS_WHILE_UNREGISTERING = """
import threading
import rospy
from process_visualizer.nodes.common.node_handle import at_shutdown, end_process

told = threading.Event()

def unregister(_reason):
    threading.Event().wait(0.5)
    print('unregistered', flush=True)

at_shutdown(told.set)
rospy.core.add_preshutdown_hook(unregister)  # as rospy's own
threading.Thread(target=rospy.signal_shutdown, args=['the test']).start()
told.wait()
end_process(3)
"""


def test_a_program_that_hears_of_its_end_first_waits_until_its_node_is_unregistered() -> None:
    """Otherwise a player that quit stayed registered at the master, with all of its topics."""
    ended = subprocess.run([sys.executable, '-c', ENDS_WHILE_UNREGISTERING], stdout=subprocess.PIPE,
                           text=True, check=False, timeout=60)
    assert (ended.stdout, ended.returncode) == ('unregistered\n', 3)
