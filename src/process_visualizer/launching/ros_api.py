# SPDX-License-Identifier: BSD-3-Clause
"""Asks a ROS master or node directly, by its address."""
from __future__ import annotations

from http.client import HTTPException
from typing import Any, Optional
from xmlrpc.client import Error, ServerProxy

import rosgraph

from process_visualizer.launching.asked_master import PATIENT_TIMEOUT_S, AskedMaster
from process_visualizer.launching.limited_transport import LimitedTransport

ANSWER_TIMEOUT_S = PATIENT_TIMEOUT_S
CALLER_ID = '/process_visualizer_watcher'


def process_id_at(uri: str) -> int:
    """The process id of the master or node at an address.

    Raises:
        OSError, HTTPException, xmlrpc.client.Error: nothing, or another program, answers within 3
        s.
        ValueError: the answer is not that of a master or node.
    """
    with ServerProxy(uri, transport=LimitedTransport(ANSWER_TIMEOUT_S)) as server:
        answer: Any = server.getPid(CALLER_ID)
    if not isinstance(answer, list) or len(answer) != 3 or answer[0] != 1:
        raise ValueError(f'{uri} is not a ROS master or node')
    return int(answer[2])


def is_registered(name: str, master_uri: Optional[str] = None) -> bool:
    """Return whether the master knows a node of that name and it answers; False without one.

    The master still knows a node that has ended without unregistering, and one that has a
    parameter in its cache. ``master_uri`` is of another master than the usual one.
    """
    try:
        process_id_at(AskedMaster(CALLER_ID, master_uri, ANSWER_TIMEOUT_S).lookupNode(name))
    except (rosgraph.MasterException, OSError, HTTPException, Error, ValueError):
        return False
    return True
