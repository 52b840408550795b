# SPDX-License-Identifier: BSD-3-Clause
"""An SSH server for a test, with a key that it accepts."""
from __future__ import annotations

import os
import shutil
import subprocess
from contextlib import contextmanager
from pathlib import Path
from typing import Iterator, Sequence

from surroundings import PATIENCE_S

_SSHD = '/usr/sbin/sshd'


def no_ssh_server() -> str:
    """Return the reason why no server can run here; empty if it can."""
    return '' if os.path.exists(_SSHD) else f'there is no {_SSHD} (package openssh-server)'


def home_with_key(folder: Path, address: str, port: int) -> Path:
    """Make a home folder with a key, and with a server at an address as a known host.

    roslaunch searches for the host without the port, ssh and paramiko with it.
    """
    (folder / '.ssh').mkdir(parents=True, mode=0o700)
    for name in ('id_rsa', 'host'):
        subprocess.run(['ssh-keygen', '-q', '-t', 'rsa', '-N', '', '-f',
                        str(folder / '.ssh' / name)], check=True)
    shutil.copy(folder / '.ssh/id_rsa.pub', folder / '.ssh/authorized_keys')
    kind, key = (folder / '.ssh/host.pub').read_text(encoding='utf-8').split()[:2]
    (folder / '.ssh/known_hosts').write_text(f'{address},[{address}]:{port} {kind} {key}\n',
                                             encoding='utf-8')
    return folder


@contextmanager
def ssh_server(prefix: Sequence[str], home: Path, port: int) -> Iterator[None]:
    """Run a server that accepts the key of a home folder.

    Args:
        prefix: of its command, for instance to run it in a network namespace.
        home: see ``home_with_key``.
        port: on which it listens.
    """
    os.makedirs('/run/sshd', exist_ok=True)
    server = subprocess.Popen([
        *prefix, _SSHD, '-D', '-e', '-f', '/dev/null', '-p', str(port),
        '-h', str(home / '.ssh/host'), '-o', f'AuthorizedKeysFile={home}/.ssh/authorized_keys',
        '-o', 'StrictModes=no', '-o', f'PidFile={home}/sshd.pid', '-o', 'UsePAM=no',
        '-o', 'PasswordAuthentication=no'], stderr=subprocess.PIPE, text=True)
    assert server.stderr is not None
    assert 'listening' in server.stderr.readline()
    try:
        yield
    finally:
        server.terminate()
        server.wait(PATIENCE_S)
        server.stderr.close()
