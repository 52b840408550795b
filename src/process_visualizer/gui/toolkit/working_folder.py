# SPDX-License-Identifier: BSD-3-Clause
"""Where the user was when the program was called."""
from __future__ import annotations

import os
from typing import Mapping


def working_folder(environment: Mapping[str, str] = os.environ) -> str:
    """Return the folder of the shell that the program was called in, if it can be written to.

    roslaunch runs its nodes in ``~/.ros``, where nobody looks for files, and leaves ``PWD`` as the
    shell has set it. Else it is the home folder.
    """
    folder = environment.get('PWD', '')
    is_usable = os.path.isabs(folder) and os.path.isdir(folder) and os.access(folder, os.W_OK)
    return folder if is_usable else os.path.expanduser('~')
