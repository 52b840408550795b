# SPDX-License-Identifier: BSD-3-Clause
"""Files that are replaced as a whole or not at all, and small ones that are read as a whole."""
from __future__ import annotations

import errno
import os
import stat
import tempfile
from contextlib import contextmanager
from typing import Iterator


@contextmanager
def whole_file(path: str) -> Iterator[str]:
    """Yield the path of a new file in the same folder, which becomes ``path`` when all is written.

    If the block raises, the new file is removed and what was there before stays as it was. A link
    stays; the file that it points to is replaced. Devices such as /dev/stdout are written directly.

    Raises:
        OSError: the file cannot be written.
    """
    if os.path.exists(path) and not os.path.isfile(path):
        yield path
        return
    path = os.path.realpath(path)
    folder, name = os.path.split(path)
    try:
        descriptor, unfinished = tempfile.mkstemp(prefix=f'.{name[:100]}-', suffix='.unfinished',
                                                  dir=folder)
    except OSError as error:
        error.filename = path  # what the user has named
        raise
    try:
        mask = os.umask(0)
        os.umask(mask)
        os.fchmod(descriptor, 0o666 & ~mask)  # as any other new file
        yield unfinished
        os.fsync(descriptor)
        os.replace(unfinished, path)
    except BaseException:
        os.unlink(unfinished)
        raise
    finally:
        os.close(descriptor)


MAX_SMALL_BYTES = 16 << 20


def small_file(path: str, most_bytes: int = MAX_SMALL_BYTES) -> bytes:
    """Return the content of a file of settings, or of another that cannot be large.

    Nothing but a regular file is opened: a pipe keeps its reader waiting, and a device may never
    end.

    Raises:
        OSError: it cannot be read, is no regular file, or is larger; ``strerror`` says so.
    """
    with open(path, 'rb', opener=_regular) as file:
        content = file.read(most_bytes + 1)
    if len(content) > most_bytes:
        raise OSError(errno.EFBIG, f'is larger than {most_bytes >> 20} MB', path)
    return content


def write_small_file(path: str, content: bytes) -> None:
    """Write a file that ``small_file`` reads.

    Raises:
        OSError: it cannot be written, or stands for something else; that is as it was.
    """
    if os.path.exists(path) and not os.path.isfile(path):
        raise OSError(errno.EINVAL, 'is not a regular file', path)
    with whole_file(path) as unfinished, open(unfinished, 'wb') as file:
        file.write(content)


def _regular(path: str, flags: int) -> int:
    if not stat.S_ISREG(os.stat(path).st_mode):
        raise OSError(errno.EINVAL, 'is not a regular file', path)
    return os.open(path, flags | os.O_NONBLOCK)  # if it has become a pipe meanwhile


def write_text(path: str, text: str) -> None:
    """Write a text in UTF-8 as a whole; what UTF-8 does not have is written as an escape.

    Raises:
        OSError: it cannot be written; what was there is as it was.
    """
    with whole_file(path) as unfinished, \
            open(unfinished, 'w', encoding='utf-8', errors='backslashreplace') as file:
        file.write(text)
