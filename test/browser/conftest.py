# SPDX-License-Identifier: BSD-3-Clause
"""Gives browsers a temporary folder for their files, which is removed after the tests."""
from __future__ import annotations

import shutil
import tempfile
from typing import Iterator

import pytest


@pytest.fixture(scope='session', autouse=True)
def folder_of_browsers() -> Iterator[None]:
    folder = tempfile.mkdtemp()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('TMPDIR', folder)
        yield
    shutil.rmtree(folder, ignore_errors=True)  # a browser may still be ending
