# SPDX-License-Identifier: BSD-3-Clause
"""Writes a file as a whole, or not at all."""
from __future__ import annotations

import os
import tempfile


def write_whole(path: str, text: str) -> None:
    """Write a text in UTF-8; what is there already is replaced only when all of it is written.

    Raises:
        OSError: it cannot be written; what was there is as it was.
    """
    folder = os.path.dirname(os.path.abspath(path))
    number, beside = tempfile.mkstemp(prefix=f'.{os.path.basename(path)}-', dir=folder)
    try:
        with os.fdopen(number, 'w', encoding='utf-8', errors='backslashreplace') as file:
            file.write(text)
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(beside, 0o666 & ~mask)
        os.replace(beside, path)
    except BaseException:
        os.unlink(beside)
        raise
