# SPDX-License-Identifier: BSD-3-Clause
"""Writes a new configuration, and the models that belong beside it."""
from __future__ import annotations

import os
from dataclasses import replace
from typing import Container, Dict, List, NamedTuple, Optional, Sequence, Tuple

from process_visualizer.bags.recorder_topics import recorded_configuration
from process_visualizer.bags.recording import Recording
from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.provenance import Origin
from process_visualizer.cell.stored_configuration import StoredConfiguration
from process_visualizer.discovery.draft_text import draft_text
from process_visualizer.discovery.evidence.bag_look import look_into
from process_visualizer.discovery.evidence.moving_frames import recorded_motions
from process_visualizer.discovery.evidence.seen import Seen
from process_visualizer.discovery.found_model import FoundModel
from process_visualizer.discovery.make_draft import make_draft
from process_visualizer.discovery.model_search import ModelSearch
from process_visualizer.discovery.recorded_models import recorded_models
from process_visualizer.discovery.stored_cell import from_stored


class NewConfiguration(NamedTuple):
    """The texts of a configuration and of the models beside it, and what it holds in words."""

    text: str
    models: Dict[str, str]
    summary: str


def new_configuration(seen: Seen, known: Sequence[FoundModel] = (),
                      search: Optional[ModelSearch] = None) -> NewConfiguration:
    """Return a configuration for what was seen; looks for models in the packages.

    Models that are ``known`` need not be looked for.

    Raises:
        ValueError: nothing was seen that belongs into one.
    """
    search = search or ModelSearch()
    made = make_draft(seen, search.find(seen, known))
    made.draft.remarks.extend(search.remarks)
    if not made.draft.devices:
        raise ValueError(f'{seen.where}: no device was seen, only what the program and ROS publish '
                         'themselves; start the drivers first')
    return NewConfiguration(draft_text(made.draft), made.models,
                            _summary([it.type for it in made.draft.devices]))


def _summary(types: Sequence[str]) -> str:
    counts = [(name, types.count(kind)) for kind, name in
              (('robot', 'robot'), ('depth_sensor', 'depth sensor'), ('other', 'other device'))]
    return ', '.join(f'{count} {name}{"" if count == 1 else "s"}' for name, count in counts
                     if count)


def from_bags(paths: Sequence[str]) -> NewConfiguration:
    """Return a configuration for a recording.

    Raises:
        BagError: it cannot be read.
        ValueError: it holds nothing of a device.
    """
    with Recording(paths) as recording:
        seen = look_into(recording)
        stored = recorded_configuration(recording)
        refused: List[str] = []
        if stored is not None:
            try:
                return of_stored(stored, seen, seen.where)
            except (ConfigurationError, ValueError, OSError) as error:
                refused = [f'The configuration in the recording is not used: {error}']
        models, of_models = recorded_models(recording)
        motions = recorded_motions(recording)
        of_bags = recording.remarks
    remarks = (*refused, *(f'{it}.' for it in of_bags), *of_models,
               *(() if models else seen.remarks))
    try:
        return new_configuration(replace(seen, remarks=remarks), models,
                                 ModelSearch(motions=motions))
    except ValueError as error:
        raise ValueError('; '.join([str(error), *of_bags])) from None


def of_stored(stored: StoredConfiguration, seen: Seen, source: str,
              origin: Origin = Origin.BAG) -> NewConfiguration:
    """Return a configuration that was stored, as far as it holds; ``source`` says where.

    Raises:
        ConfigurationError, ValueError, OSError: it cannot be used here.
    """
    made = from_stored(stored, seen, source, origin)
    return NewConfiguration(made.text, made.files,
                            _summary([it.type.value for it in made.cell.devices]))


def write_new(new: NewConfiguration, path: str,
              may_overwrite: Optional[Container[str]] = ()) -> Tuple[str, ...]:
    """Write a configuration and its models; return their paths, that of the configuration first.

    Of the files that are there those that ``may_overwrite`` names are overwritten (None: all), and
    a model that is the same is left as it is.

    Raises:
        FileExistsError: there is one of these files, and it may not be overwritten.
        OSError: one cannot be written.
    """
    folder = os.path.dirname(os.path.abspath(path))
    texts = {path: new.text, **{os.path.join(folder, name): text
                                for name, text in new.models.items()}}
    for file in texts if may_overwrite is not None else ():
        if file not in (may_overwrite or ()) and os.path.lexists(file) and (
                file == path or not _holds(file, texts[file])):
            raise FileExistsError(f'"{file}" is there already')
    for file, text in reversed(list(texts.items())):
        if file != path and os.path.dirname(file) != folder:
            os.makedirs(os.path.dirname(file), exist_ok=True)
        with open(file, 'w', encoding='utf-8', errors='surrogateescape', newline='') as stream:
            stream.write(text)
    return tuple(texts)


def _holds(file: str, text: str) -> bool:
    try:
        with open(file, encoding='utf-8', errors='surrogateescape', newline='') as stream:
            return stream.read() == text
    except OSError:
        return False
