# SPDX-License-Identifier: BSD-3-Clause
"""The short form of ``fuzz/run.py``: the same inputs each time, some of each target."""
from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / 'fuzz'))

from targets import TARGETS, Target  # noqa: E402

_MOST = {'bags': 5, 'configurations': 300, 'definitions': 1000}
"""Number of inputs of slow targets; damaged bags have a separate test."""
_INPUTS = 3000


@pytest.mark.parametrize('target', TARGETS, ids=lambda it: it.name)
def test_bad_input_is_read_or_refused(target: Target, tmp_path: Path) -> None:
    fed = target.begin(tmp_path)
    refused = sum(fed(number) for number in range(_MOST.get(target.name, _INPUTS)))
    assert refused  # otherwise no input would have been bad
