# SPDX-License-Identifier: BSD-3-Clause
"""Advice for a user whose programs may not use real-time priority."""
from __future__ import annotations

import getpass
import resource
from pathlib import Path
from typing import Callable, Optional

_REAL_TIME_PRIORITY = 10  # above the lowest priority, which joint_proc and the player's sender use
_CAP_SYS_NICE = 23  # bit number, see capabilities(7)
_EFFECTIVE = 'CapEff:'
_STATUS = Path('/proc/self/status')


def give_real_time_advice(print_line: Callable[[str], None]) -> None:
    """Print advice for a user without real-time priority."""
    advice = real_time_advice()
    if advice is not None:
        print_line(advice)


def real_time_advice() -> Optional[str]:
    """Return the benefit of real-time priority and how to allow it; None if it is allowed."""
    if may_have_real_time_priority(_STATUS.read_text(encoding='utf-8'),
                                   resource.getrlimit(resource.RLIMIT_RTPRIO)[0]):
        return None
    return ('without real-time priority, display and playback may be late while the machine is '
            f'busy; the line "{getpass.getuser()} - rtprio {_REAL_TIME_PRIORITY}" in '
            '/etc/security/limits.conf allows it after the next login')


def may_have_real_time_priority(status: str, limit: int) -> bool:
    """Return whether a process may use real-time priority, by its status file and RLIMIT_RTPRIO."""
    masks = [line.split()[1] for line in status.splitlines() if line.startswith(_EFFECTIVE)]
    has_capability = any(int(mask, 16) >> _CAP_SYS_NICE & 1 for mask in masks)
    return has_capability or limit == resource.RLIM_INFINITY or limit > 0
