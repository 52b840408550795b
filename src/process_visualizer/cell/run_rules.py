# SPDX-License-Identifier: BSD-3-Clause
"""Rules about the events of the process, and about what a run is."""
from __future__ import annotations

from typing import Dict, Sequence

from process_visualizer.cell.builder import absolute_topic
from process_visualizer.cell.element_reader import Parsed
from process_visualizer.cell.errors import Location, ProblemList
from process_visualizer.cell.model import Device
from process_visualizer.cell.suggestions import nearest


def check_run(events: Sequence[Parsed], runs: Sequence[Parsed], phases: Sequence[Parsed],
              problems: ProblemList) -> None:
    """Report events of one name, a second run, and a misspelt event of the run or of a phase.

    A run may also begin or end at a mark, whose label only a recording knows.
    """
    first: Dict[str, Location] = {}
    for event in events:
        name = event.values.get('name')
        if name in first:
            problems.add(event.location, 'event', f'an event named "{name}" already exists '
                                                  f'({first[name]}); choose another name')
        elif name:
            first[name] = event.location
    for run in runs[1:]:
        if run.location.file != runs[0].location.file:  # otherwise it has been reported
            problems.add(run.location, 'run', f'occurs more than once ({runs[0].location}); '
                                              'keep one')
    for run in runs:
        for end in ('begin', 'end'):
            _check_name(run, end, first, problems)
    for phase in phases:
        for end in ('from', 'to'):
            _check_name(phase, end, first, problems)


def check_event_topics(events: Sequence[Parsed], devices: Sequence[Device],
                       problems: ProblemList) -> None:
    """Report events of topics that no recording would have."""
    recorded = {topic.name for device in devices for topic in device.topics if topic.record}
    for event in events:
        topic = event.values.get('topic')
        if topic and absolute_topic('', topic) not in recorded:
            problems.add(event.location, 'event', f'the topic "{topic}" is not recorded; add it to '
                                                  'its device with <topic>')


def _check_name(run: Parsed, end: str, names: Dict[str, Location], problems: ProblemList) -> None:
    given = run.values.get(end)
    if given and given not in names:
        meant = nearest(given, names)
        if meant is not None:
            problems.add(run.location, run.tag, f'attribute "{end}": there is no event "{given}"; '
                                              f'did you mean "{meant}"?')
