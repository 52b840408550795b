# SPDX-License-Identifier: BSD-3-Clause
"""A screen that nobody sees, for windows of which pictures are taken."""
from __future__ import annotations

import os
import shutil
import subprocess
from types import TracebackType
from typing import Dict, Optional, Type

from process_visualizer.launching.roslaunch_process import dying_with_parent

_END_TIMEOUT_S = 5.0


class ScreenError(Exception):
    """There is no screen, or no picture of it; says why and what to do."""


class VirtualScreen:
    """An X server in memory (Xvfb), from ``with`` on; drawn without the help of a graphics card.

    The operator's own screen, if there is one, shows nothing of it. Open it in a thread that lives
    as long as the program does: the kernel ends the server when that thread ends.
    """

    def __init__(self, width: int, height: int) -> None:
        """Take its size in px."""
        self._size = f'{width}x{height}x24'
        self._server: Optional['subprocess.Popen[bytes]'] = None
        self._name = ''

    def __enter__(self) -> VirtualScreen:
        """Start it.

        Raises:
            ScreenError: it cannot be started.
        """
        program = shutil.which('Xvfb')
        if program is None:
            raise ScreenError('there is no Xvfb; install the package xvfb')
        read, write = os.pipe()
        with os.fdopen(read, encoding='ascii') as number:
            try:
                self._server = subprocess.Popen(
                    [*dying_with_parent(), program, '-displayfd', str(write), '-screen', '0',
                     self._size, '-nolisten', 'tcp'], pass_fds=[write],
                    stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL, start_new_session=True)
            except OSError as error:
                raise ScreenError(f'Xvfb cannot be started: {error}') from None
            finally:
                os.close(write)
            self._name = number.readline().strip()
        if not self._name:
            self.close()
            raise ScreenError('Xvfb has ended before it had a screen')
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 trace: Optional[TracebackType]) -> None:
        self.close()

    @property
    def variables(self) -> Dict[str, str]:
        """The environment of programs that are to be seen on it."""
        return {'DISPLAY': f':{self._name}', 'LIBGL_ALWAYS_SOFTWARE': '1',
                'QT_X11_NO_MITSHM': '1', 'QT_QPA_PLATFORM': 'xcb'}

    def picture(self, area: str) -> bytes:
        """Return an area of it, such as 800x600+0+0 (width, height, x, y in px), as a JPEG.

        Raises:
            ScreenError: ImageMagick fails.
        """
        try:
            return subprocess.run(
                ['import', '-silent', '-window', 'root', '-crop', area, '+repage', '-quality',
                 '88', 'jpeg:-'], env={**os.environ, **self.variables}, check=True,
                stdout=subprocess.PIPE).stdout
        except (OSError, subprocess.CalledProcessError) as error:
            raise ScreenError(f'ImageMagick cannot take a picture: {error}') from None

    def close(self) -> None:
        """End it."""
        if self._server is not None:
            self._server.terminate()
            try:
                self._server.wait(_END_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                self._server.kill()
                self._server.wait()
        self._server = None
