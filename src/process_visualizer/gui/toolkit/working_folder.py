# SPDX-License-Identifier: BSD-3-Clause
"""The folder in which the user called the program."""
from __future__ import annotations

import os
from typing import Mapping


def working_folder(environment: Mapping[str, str] = os.environ) -> str:
    """Return the folder of the shell that called the program, if it is writable.

    roslaunch runs its nodes in ``~/.ros``, where nobody looks for files, and leaves ``PWD`` as the
    shell has set it. The fallback is the home folder.
    """
    folder = environment.get('PWD', '')
    is_usable = os.path.isabs(folder) and os.path.isdir(folder) and os.access(folder, os.W_OK)
    return folder if is_usable else os.path.expanduser('~')
