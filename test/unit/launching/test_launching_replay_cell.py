# SPDX-License-Identifier: BSD-3-Clause
"""The master of a replay gets a port when it is needed, as other programs take ports meanwhile."""
from __future__ import annotations

from typing import Any, List
from unittest import mock

import pytest

from process_visualizer.launching.replay_cell import ReplayCell
from process_visualizer.launching.ros_master import RosMasterError


def test_each_attempt_to_start_has_a_port_of_its_own() -> None:
    masters: List[Any] = []

    def taken_meanwhile(uri: str) -> Any:
        masters.append(mock.Mock(uri=uri, **{'ensure.side_effect': RosMasterError('taken')}))
        return masters[-1]

    cell = ReplayCell(mock.Mock(), make_master=taken_meanwhile)
    assert not masters
    for _ in range(2):
        with pytest.raises(RosMasterError):
            cell.show(mock.Mock())
    assert len({it.uri for it in masters}) == 2
    cell.stop()
    assert all(it.stop.called for it in masters)
