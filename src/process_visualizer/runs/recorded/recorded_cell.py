# SPDX-License-Identifier: BSD-3-Clause
"""The cell that a recording was made of, by the configuration in it."""
from __future__ import annotations

import tempfile
from contextlib import contextmanager
from typing import Iterator

from process_visualizer.bags.bag_errors import BagError
from process_visualizer.bags.recorder_topics import recorded_configuration
from process_visualizer.bags.recording import Recording
from process_visualizer.cell.model import Cell
from process_visualizer.cell.provenance import Origin, Provenance
from process_visualizer.cell.stored_configuration import write_configuration
from process_visualizer.cell.trusted_packages import trusted_packages
from process_visualizer.cell.xml_parser import XmlParser


@contextmanager
def recorded_cell(recording: Recording) -> Iterator[Cell]:
    """Yield the cell; while it is used, the models beside its configuration exist.

    Nothing in it may run but nodes of packages that the user trusts.

    Raises:
        BagError: the recording holds no configuration.
        ConfigurationError: it is none on this machine.
        OSError: its files cannot be written, or the list of trusted packages cannot be read.
    """
    stored = recorded_configuration(recording)
    if stored is None:
        raise BagError(recording.paths[0], 'holds no configuration; name one with --config')
    with tempfile.TemporaryDirectory(prefix='process_visualizer-') as folder:
        provenance = Provenance(Origin.BAG, folder, trusted_packages())
        yield XmlParser(stored.arguments, provenance).parse(write_configuration(stored, folder))
