# SPDX-License-Identifier: BSD-3-Clause
"""The present problems of a node, each for as long as it lasts. Imports no rospy."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Dict, List, Mapping, Optional

HOLD_S = 3.0
"""A complaint lasts this long [s] after the last bad message, so that it does not blink."""


@dataclass
class Complaint:
    """A problem with something; times are those of a clock that does not jump [s]."""

    text: str
    since_s: float
    last_s: float
    is_error: bool = False
    count: int = 0  # of messages; 0 where it is not about messages
    values: Mapping[str, str] = field(default_factory=dict)  # for programs
    good_s: Optional[float] = None  # when the last good message came after a bad one


class ComplaintBook:
    """The complaints by their key: what they are about, such as a topic or a frame.

    A complaint about messages ends when good ones come and no bad one has come for some time;
    if no message comes at all, the complaint remains.
    """

    def __init__(self) -> None:
        """There are no complaints at first."""
        self._complaints: Dict[str, Complaint] = {}
        self._ended: List[str] = []

    def add(self, key: str, text: str, now_s: float, is_error: bool = False,
            values: Optional[Mapping[str, str]] = None) -> None:
        """Note a bad message."""
        complaint = self._write(key, text, now_s, is_error)
        complaint.count, complaint.values = complaint.count + 1, values or {}

    def state(self, key: str, text: str, now_s: float,
              values: Optional[Mapping[str, str]] = None, is_error: bool = False) -> None:
        """Set a complaint that lasts until `end`."""
        self._write(key, text, now_s, is_error).values = values or {}

    def note_good(self, key: str, now_s: float) -> None:
        """Note a good message."""
        complaint = self._complaints.get(key)
        if complaint is not None:
            complaint.good_s = now_s

    def end(self, key: str) -> None:
        """End the complaint about something."""
        if self._complaints.pop(key, None) is not None:
            self._ended.append(key)

    def present(self, now_s: float) -> Dict[str, Complaint]:
        """Return the present complaints."""
        for key in [key for key, it in self._complaints.items()
                    if it.good_s is not None and now_s - it.last_s > HOLD_S]:
            self.end(key)
        return self._complaints

    def take_ended(self) -> List[str]:
        """Return the keys of complaints that have ended since the last call."""
        ended, self._ended = self._ended, []
        return [key for key in ended if key not in self._complaints]

    def _write(self, key: str, text: str, now_s: float, is_error: bool = False) -> Complaint:
        complaint = self._complaints.setdefault(key, Complaint(text, now_s, now_s))
        complaint.text, complaint.last_s = text, now_s
        complaint.is_error, complaint.good_s = is_error, None
        return complaint
