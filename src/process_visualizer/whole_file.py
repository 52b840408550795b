# SPDX-License-Identifier: BSD-3-Clause
"""Files that are replaced atomically, and small files that are read as a whole."""
from __future__ import annotations

import errno
import os
import stat
import tempfile
from contextlib import contextmanager
from typing import Iterator

_NAME_BYTES = 100
"""Number of bytes of a name that its unfinished file's name keeps; a name may have 255 bytes."""


@contextmanager
def whole_file(path: str) -> Iterator[str]:
    """Yield the path of a new file in the same folder, which replaces ``path`` after the block.

    If the block raises, the new file is removed and the previous file stays unchanged. A link
    stays; the file it points to is replaced. Devices such as /dev/stdout are written directly.

    Raises:
        OSError: the file cannot be written.
    """
    if os.path.exists(path) and not os.path.isfile(path):
        yield path
        return
    path = os.path.realpath(path)
    folder, name = os.path.split(path)
    begin = os.fsencode(name)[:_NAME_BYTES].decode('utf-8', 'ignore')
    try:
        descriptor, unfinished = tempfile.mkstemp(prefix=f'.{begin}-', suffix='.unfinished',
                                                  dir=folder)
    except OSError as error:
        error.filename = path  # the path that the user named
        raise
    try:
        mask = os.umask(0)
        os.umask(mask)
        os.fchmod(descriptor, 0o666 & ~mask)  # like any other new file
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
    """Return the content of a small file, such as one of settings.

    Only a regular file is opened: a pipe would keep its reader waiting, and a device may never end.

    Raises:
        OSError: the file cannot be read, is not regular, or is too large; see ``strerror``.
    """
    with open(path, 'rb', opener=_regular) as file:
        content = file.read(most_bytes + 1)
    if len(content) > most_bytes:
        raise OSError(errno.EFBIG, f'is larger than {most_bytes >> 20} MB', path)
    return content


def write_small_file(path: str, content: bytes) -> None:
    """Write a file for ``small_file``.

    Raises:
        OSError: the file cannot be written, or is not regular; it stays unchanged.
    """
    if os.path.exists(path) and not os.path.isfile(path):
        raise OSError(errno.EINVAL, 'is not a regular file', path)
    with whole_file(path) as unfinished, open(unfinished, 'wb') as file:
        file.write(content)


def _regular(path: str, flags: int) -> int:
    if not stat.S_ISREG(os.stat(path).st_mode):
        raise OSError(errno.EINVAL, 'is not a regular file', path)
    return os.open(path, flags | os.O_NONBLOCK)  # in case it has become a pipe since


def write_text(path: str, text: str) -> None:
    """Write a text atomically in UTF-8; characters that UTF-8 cannot encode are escaped.

    Raises:
        OSError: the file cannot be written; the previous one stays unchanged.
    """
    with whole_file(path) as unfinished, \
            open(unfinished, 'w', encoding='utf-8', errors='backslashreplace') as file:
        file.write(text)
