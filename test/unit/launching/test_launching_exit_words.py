# SPDX-License-Identifier: BSD-3-Clause
"""The wording of process ends."""
from __future__ import annotations

from typing import Optional

import pytest

from process_visualizer.launching.part_report import exit_words


@pytest.mark.parametrize('code, words', [
    (None, 'ended with code unknown'), (0, 'ended with code 0'), (3, 'ended with code 3'),
    (-9, 'killed by SIGKILL'), (-11, 'killed by SIGSEGV'),
    (-63, 'killed by signal 63')])
def test_the_end_is_told(code: Optional[int], words: str) -> None:
    assert exit_words(code) == words
