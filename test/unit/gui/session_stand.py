# SPDX-License-Identifier: BSD-3-Clause
"""A session without the models that normally set its values."""
from __future__ import annotations

from typing import Iterable, Optional

from process_visualizer.bagio.catalog import Catalog
from process_visualizer.cell.model import Cell, Device, Mode
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.plan import BAG_PART, FRAMES_PART
from process_visualizer.gui.session import Session
from process_visualizer.launching.part_report import PartReport, PartState


def choose(session: Session, devices: Iterable[Device], file: str = '/cell.xml') -> None:
    """Select a cell of these devices, all of them ticked."""
    open_cell(session, Cell(file, 'world', tuple(devices)))


def open_cell(session: Session, cell: Cell) -> None:
    """Select a cell, with all its devices ticked."""
    session.set_cell(cell, cell.devices)


def run(session: Session, mode: Optional[Mode], state: PartState = PartState.RUNNING) -> None:
    """Let the cell run in a mode, with this state of its own parts; None: nothing runs."""
    cell = session.cell or Cell('/cell.xml', 'world', ())
    session.set_run(None if mode is None else Choice(cell, mode, session.chosen), mode is not None,
                    {part: PartReport(part, state) for part in (BAG_PART, FRAMES_PART)})


def play(session: Session, *paths: str) -> None:
    """Open a recording."""
    session.set_recording(Catalog(paths, 0, 10.0, 0, 0, ()))
