# SPDX-License-Identifier: BSD-3-Clause
"""Events of a recording, as text beside the bag."""
from __future__ import annotations

import os

from process_visualizer.bags.bag_errors import BagError


def events_path(bag: str) -> str:
    """Return the file beside a bag that says what happened while it was recorded."""
    return f'{bag}.events.txt'


def write_events(bag: str, text: str) -> None:
    """Write the file beside a bag, all at once.

    Raises:
        BagError: it cannot be written.
    """
    path = events_path(bag)
    unfinished = f'{path}.unfinished'
    try:
        with open(unfinished, 'w', encoding='utf-8') as file:
            file.write(text + '\n')
        os.replace(unfinished, path)
    except OSError as error:
        raise BagError(path, f'cannot be written: {error.strerror}') from error
