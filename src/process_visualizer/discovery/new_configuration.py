"""Writes a new configuration, and the models that belong beside it."""
from __future__ import annotations

import dataclasses
import os
from typing import Container, Dict, NamedTuple, Optional, Sequence, Tuple

from process_visualizer.bags.recording import Recording
from process_visualizer.discovery.bag_look import look_into
from process_visualizer.discovery.draft_text import draft_text
from process_visualizer.discovery.found_model import FoundModel
from process_visualizer.discovery.make_draft import make_draft
from process_visualizer.discovery.model_search import ModelSearch
from process_visualizer.discovery.recorded_models import recorded_models
from process_visualizer.discovery.seen import Seen


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
    counts = [(name, sum(it.type == kind for it in made.draft.devices)) for kind, name in
              (('robot', 'robot'), ('depth_sensor', 'depth sensor'), ('other', 'other device'))]
    summary = ', '.join(f'{count} {name}{"" if count == 1 else "s"}' for name, count in counts
                        if count)
    return NewConfiguration(draft_text(made.draft), made.models, summary)


def from_bags(paths: Sequence[str]) -> NewConfiguration:
    """Return a configuration for a recording.

    Raises:
        BagError: it cannot be read.
        ValueError: it holds nothing of a device.
    """
    with Recording(paths) as recording:
        models, remarks = recorded_models(recording)
        seen = look_into(recording)
    told = remarks if models else [*remarks, *seen.remarks]
    return new_configuration(dataclasses.replace(seen, remarks=tuple(told)), models)


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
        with open(file, 'w', encoding='utf-8') as stream:
            stream.write(text)
    return tuple(texts)


def _holds(file: str, text: str) -> bool:
    try:
        with open(file, encoding='utf-8') as stream:
            return stream.read() == text
    except (OSError, UnicodeDecodeError):
        return False
