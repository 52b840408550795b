# SPDX-License-Identifier: BSD-3-Clause
"""Decides which topics are ticked at first, and whether name, folder and disk can be used."""
from __future__ import annotations

import os
import shutil
from enum import Enum
from pathlib import Path
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Set, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.model import Device
from process_visualizer.cell.outputs import recorded_outputs
from process_visualizer.clients.bag_recorder import RecordingOptions
from process_visualizer.figures import long_time_text, size_text
from process_visualizer.gui.recording.recording_types import RecordingPhase
from process_visualizer.gui.ros.snapshots import RecorderSnapshot, TopicSnapshot
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import NewestCall, Tasks
from process_visualizer.health.topic_silence import TopicWatch

FOR_ANYBODY = ('/tmp', '/dev/shm', '/media', '/run/media', '/mnt')
"""Folders that the recorder accepts from any client, in addition to the home folder."""
MIN_FREE_BYTES = 1 << 30
"""Minimum free space to start a recording (the recorder's parameter ~minimum_free_megabytes)."""


class BagTarget(NamedTuple):
    """The result of a check of the disk; ``problem`` says what is wrong and what to do, or ''.

    ``free_bytes`` and ``total_bytes`` of the disk are None if it cannot be read. ``free_name`` is
    an unused name similar to the given one.
    """

    problem: str = ''
    free_bytes: Optional[int] = None
    total_bytes: Optional[int] = None
    free_name: str = ''


def look_at(folder: str, name: str = '', prefix: str = '') -> BagTarget:
    """Check whether a bag can be recorded into a folder (an absolute path); reads the disk.

    ``name`` is the operator's; '' if the recorder makes one of date and time, possibly with a
    prefix.
    """
    existing = _existing_parent(Path(folder))
    room = _room(existing)
    problem = (_folder_problem(Path(folder), existing, room.free_bytes)
               or _name_problem(name or prefix))
    if problem or not is_taken(folder, name):
        return room._replace(problem=problem)
    free_name = _free_name(folder, stem_of(name))
    return room._replace(
        free_name=free_name, problem=f'{stem_of(name)}.bag exists already and is not overwritten; '
                                     f'choose another name, such as {free_name}')


def is_for_anybody(folder: str, home: str) -> bool:
    """Return whether the recorder accepts the folder from any client.

    These are the defaults of its parameter ``~folders``; any other folder must be named when the
    recorder is started.
    """
    wanted = Path(os.path.realpath(folder))
    allowed = [Path(os.path.realpath(path)) for path in (home, *FOR_ANYBODY)]
    return any(above == wanted or above in wanted.parents for above in allowed)


def stem_of(name: str) -> str:
    """Return a name without the ending .bag, as the recorder uses it."""
    return name[:-4] if name.endswith('.bag') and len(name) > 4 else name


def is_taken(folder: str, name: str) -> bool:
    """Return whether a bag of a name exists: finished, being recorded, or split."""
    stem = os.path.join(folder, stem_of(name))
    return bool(name) and any(os.path.lexists(f'{stem}{part}.bag{ending}')
                              for part in ('', '_0') for ending in ('', '.active'))


def _free_name(folder: str, stem: str) -> str:
    number = 2
    while is_taken(folder, f'{stem}-{number}'):
        number += 1
    return f'{stem}-{number}'


def _existing_parent(folder: Path) -> Path:
    while not os.path.lexists(folder) and folder != folder.parent:
        folder = folder.parent
    return folder


def _room(folder: Path) -> BagTarget:
    try:
        usage = shutil.disk_usage(folder)
    except OSError:
        return BagTarget()
    return BagTarget(free_bytes=usage.free, total_bytes=usage.total)


def _folder_problem(folder: Path, existing: Path, free_bytes: Optional[int]) -> str:
    if not folder.is_absolute():
        return f'Enter a full path (starting with /) instead of "{folder}"'
    if not existing.is_dir():
        return f'{existing} is not a folder; choose another'
    if os.statvfs(existing).f_flag & os.ST_RDONLY:
        return f'the disk of {existing} is mounted read-only; choose a folder on another one'
    if not os.access(existing, os.W_OK | os.X_OK):
        return (f'you have no write permission for {existing}; choose another folder, or ask '
                'its owner')
    if free_bytes is not None and free_bytes < MIN_FREE_BYTES:
        return (f'the disk of {folder} is full: a recording needs '
                f'{size_text(MIN_FREE_BYTES - free_bytes)} more; delete old recordings or choose '
                'another disk')
    return ''


def _name_problem(name: str) -> str:
    if '/' in name:
        return f'the name "{name}" must not contain a slash; choose the folder above it'
    if name.startswith('.'):
        return f'the name "{name}" must not start with a dot'
    if not name.isprintable():
        return 'the name has a character that cannot be printed; choose another'
    return ''


# Ticks of the topics to record: preset by the configuration, changed by the operator.

class TopicHealth(Enum):
    """The health of a topic; the recorder reports only on topics that it watches."""

    UNKNOWN = 'unknown'
    GOOD = 'good'
    NO_PUBLISHER = 'no publisher'
    NO_MESSAGE = 'no message yet'
    SILENT = 'silent'


class TopicRow(NamedTuple):
    """A topic as the operator sees it; rate in Hz and silence in s are None if not known."""

    name: str
    device: str
    is_ticked: bool
    health: TopicHealth
    rate_hz: Optional[float] = None
    silence_s: Optional[float] = None
    dropped: int = 0
    lost: int = 0
    is_latched: bool = False


class TopicTicks:
    """The topics of devices; the operator's ticks stay when the devices change."""

    def __init__(self) -> None:
        self._topics: Dict[str, Tuple[str, bool]] = {}  # device, preset
        self._changed: Dict[str, bool] = {}
        self._seen: Dict[str, TopicSnapshot] = {}
        self._watch = TopicWatch()
        self._silent: Set[str] = set()

    def set_devices(self, devices: Sequence[Device]) -> None:
        """Set the devices; a topic of two devices is listed with the first."""
        self._topics = {}
        for device in devices:
            for topic in device.topics:
                owner, record = self._topics.get(topic.name, (device.name, False))
                self._topics[topic.name] = (owner, record or topic.record)
            self._topics.update((it, (device.name, True)) for it in recorded_outputs(device))

    def tick(self, topic: str, is_ticked: bool) -> None:
        """Set whether a topic is recorded."""
        self._changed[topic] = is_ticked

    def preset(self) -> None:
        """Tick the topics that the configuration records."""
        self._changed.clear()

    def take(self, topics: Sequence[TopicSnapshot]) -> None:
        """Update from the recorder's report on the topics that it watches."""
        if not topics:
            self._watch = TopicWatch()  # a new run begins
        self._seen = {topic.name: topic for topic in topics}
        self._silent = {it.name for it in topics if self._watch.update(
            it.name, it.rate_hz, it.silence_s, it.messages, it.largest_gap_s,
            it.is_latched).is_silent}

    def ticked(self) -> Tuple[str, ...]:
        """Return the names of the topics to record."""
        return tuple(name for name in self._topics if self._is_ticked(name))

    @property
    def changed(self) -> Dict[str, bool]:
        """The operator's ticks that differ from the configuration's; for ``restore``."""
        return {name: is_ticked for name, is_ticked in self._changed.items()
                if name not in self._topics or is_ticked != self._topics[name][1]}

    def restore(self, changed: Mapping[str, bool]) -> None:
        """Restore the operator's ticks of an earlier session."""
        self._changed = {str(name): bool(is_ticked) for name, is_ticked in changed.items()}

    def ticked_share(self) -> float:
        """Return the share of the bytes that arrive now on topics to record."""
        rates = {it.name: it.rate_hz * it.bytes / max(it.messages, 1) for it in self._seen.values()}
        wanted = sum(rate for name, rate in rates.items()
                     if name not in self._topics or self._is_ticked(name))
        total = sum(rates.values())
        return wanted / total if total > 0.0 else 1.0

    def rows(self) -> List[TopicRow]:
        """Return all topics, in the order of the devices."""
        return [self._row(name) for name in self._topics]

    def _is_ticked(self, name: str) -> bool:
        return self._changed.get(name, self._topics[name][1])

    def _row(self, name: str) -> TopicRow:
        device, _ = self._topics[name]
        seen = self._seen.get(name)
        if seen is None:
            return TopicRow(name, device, self._is_ticked(name), TopicHealth.UNKNOWN)
        return TopicRow(name, device, self._is_ticked(name), self._health(seen), seen.rate_hz,
                        seen.silence_s, seen.dropped, seen.lost, seen.is_latched)

    def _health(self, topic: TopicSnapshot) -> TopicHealth:
        if topic.publishers == 0:
            return TopicHealth.NO_PUBLISHER
        if topic.silence_s is None:
            return TopicHealth.NO_MESSAGE
        return TopicHealth.SILENT if topic.name in self._silent else TopicHealth.GOOD


class NameChoice(Enum):
    """The ways to name a bag, in the order of the thesis' figure 5.3."""

    DATE = 'date'
    PREFIX = 'prefix'
    NAME = 'name'


class RecordingChoices(QObject):
    """The options of the next recording, and problems with them on the disk."""

    changed = pyqtSignal()
    topics_changed = pyqtSignal()
    """The list of topics has changed (changes of ticks and rates emit ``changed``)."""
    _looked = pyqtSignal(object, object)

    def __init__(self, tasks: Tasks, session: Session, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._ticks = TopicTicks()
        self._looked.connect(self._take_target)
        self._looks = NewestCall[RecordingOptions](
            tasks, 'files', lambda it: self._looked.emit(it, _target_of(it)), lambda: None, _raise)
        self._target = BagTarget()
        self._settings = {'choice': NameChoice.DATE.value, 'prefix': '', 'name': '',
                          'folder': os.path.expanduser('~/bags')}
        self._devices: Tuple[Device, ...] = ()
        for other in (session.cell_changed, session.run_changed):
            other.connect(lambda: self._follow_devices(session.live_devices))

    @property
    def name_choice(self) -> NameChoice:
        """Return how the bag gets its name."""
        return NameChoice(self._settings['choice'])

    @property
    def prefix(self) -> str:
        """The prefix before date and time."""
        return self._settings['prefix']

    @property
    def name(self) -> str:
        """The given name, without .bag."""
        return self._settings['name']

    @property
    def folder(self) -> str:
        """The absolute path of the folder for recordings."""
        return self._settings['folder']

    @property
    def problem(self) -> str:
        """Return why folder or name cannot be used, and what to do; '' if both can."""
        if self.name_choice is NameChoice.NAME and not self.name:
            return 'write a name, or choose date and time'
        return self._target.problem

    @property
    def free_name(self) -> str:
        """An unused name if the given one is taken; otherwise ''."""
        return self._target.free_name

    @property
    def free_bytes(self) -> Optional[int]:
        """The free space on the folder's disk; None if not known."""
        return self._target.free_bytes

    @property
    def total_bytes(self) -> Optional[int]:
        """The size of the folder's disk; None if not known."""
        return self._target.total_bytes

    @property
    def topics(self) -> List[TopicRow]:
        """The topics of the running devices, or without any, of the chosen ones."""
        return self._ticks.rows()

    def choose_name(self, choice: NameChoice) -> None:
        """Choose how the bag gets its name."""
        self._set({'choice': choice.value})

    def set_prefix(self, prefix: str) -> None:
        """Set the prefix before date and time."""
        self._set({'prefix': prefix.strip()})

    def set_name(self, name: str) -> None:
        """Set the given name, with or without .bag."""
        self._set({'name': stem_of(name.strip())})

    def set_folder(self, folder: str) -> None:
        """Set the folder for recordings; ~ is the home folder."""
        self._set({'folder': os.path.expanduser(folder.strip())})

    def settings(self) -> Dict[str, str]:
        """Return the settings to save for the next session; for ``restore``."""
        return dict(self._settings)

    def restore(self, settings: Mapping[str, str]) -> None:
        """Restore saved settings; invalid entries are ignored."""
        known = {key: str(settings[key]) for key in self._settings if settings.get(key)}
        if known.get('choice') not in [choice.value for choice in NameChoice]:
            known.pop('choice', None)
        self._set(known)

    def _follow_devices(self, devices: Tuple[Device, ...]) -> None:
        if devices == self._devices:
            return
        self._devices = devices
        before = [(row.name, row.device) for row in self.topics]
        self._ticks.set_devices(devices)
        if [(row.name, row.device) for row in self.topics] != before:
            self.topics_changed.emit()
        self.changed.emit()

    def tick(self, topic: str, is_ticked: bool) -> None:
        """Set whether a topic is recorded."""
        self._ticks.tick(topic, is_ticked)
        self.changed.emit()

    def preset_topics(self) -> None:
        """Tick the topics that the configuration records."""
        self._ticks.preset()
        self.changed.emit()

    @property
    def changed_ticks(self) -> Dict[str, bool]:
        """The operator's ticks that differ from the configuration's, by topic."""
        return self._ticks.changed

    def restore_ticks(self, changed: Mapping[str, bool]) -> None:
        """Restore the operator's ticks of an earlier session.

        Raises:
            AttributeError: these are not such ticks.
        """
        self._ticks.restore(changed)
        self.changed.emit()

    def ticked_share(self) -> float:
        """Return the share of the bytes that arrive now on topics to record."""
        return self._ticks.ticked_share()

    def take_topics(self, topics: Sequence[TopicSnapshot]) -> None:
        """Update from the recorder's report on topics; the caller emits ``changed``."""
        self._ticks.take(topics)

    def look(self) -> None:
        """Check the disk, off the GUI thread; ``changed`` is emitted if anything is new."""
        self._looks.request(self.options())

    def options(self) -> RecordingOptions:
        """Return the options of the next recording."""
        choice = self.name_choice
        return RecordingOptions(
            topics=self._ticks.ticked(), folder=self.folder,
            prefix=self.prefix if choice is NameChoice.PREFIX else '',
            name=self.name if choice is NameChoice.NAME else '')

    def options_to_save(self, recent_s: float) -> RecordingOptions:
        """Return the options to save the last seconds; date and time make the name unique."""
        prefix = {NameChoice.DATE: '', NameChoice.PREFIX: self.prefix,
                  NameChoice.NAME: self.name}[self.name_choice]
        return RecordingOptions(folder=self.folder, prefix=prefix, recent_s=recent_s)

    def _set(self, settings: Mapping[str, str]) -> None:
        self._settings.update(settings)
        self._target = self._target._replace(problem='', free_name='')
        self.look()
        self.changed.emit()

    def _take_target(self, looked: RecordingOptions, target: BagTarget) -> None:
        """Adopt the result of a check, unless folder or name have been changed meanwhile."""
        if target != self._target and _place(looked) == _place(self.options()):
            self._target = target
            self.changed.emit()


def _place(options: RecordingOptions) -> Tuple[str, str, str]:
    return options.folder, options.name, options.prefix


def _target_of(options: RecordingOptions) -> BagTarget:
    folder, name, prefix = _place(options)
    try:
        return look_at(folder, name, prefix)
    except (OSError, ValueError) as error:
        return BagTarget(f'{folder} cannot be used: {error}; choose another')


def _raise(error: Exception) -> None:
    raise error


_LOW_S = 300.0


class DiskRoom(NamedTuple):
    """The free space on the disk, and the time that can be recorded there; None if not known.

    ``limit_bytes`` is the space that the recorder leaves free; a recording stops there.
    """

    free_bytes: Optional[int]
    time_left_s: Optional[float]
    limit_bytes: int = MIN_FREE_BYTES
    is_recording: bool = False

    @property
    def is_low(self) -> bool:
        """Return whether a recording would stop in less than five minutes."""
        return self.time_left_s is not None and self.time_left_s < _LOW_S

    @property
    def free_text(self) -> str:
        """The free space, in words."""
        return '' if self.free_bytes is None else f'{_exact_size(self.free_bytes)} free'

    @property
    def limit_text(self) -> str:
        """The free space at which a recording stops, in words."""
        return f'A recording stops when free space drops to {_exact_size(self.limit_bytes)}' \
            if self.limit_bytes else 'A recording stops when the disk is full'

    @property
    def time_text(self) -> str:
        """The time that can be recorded, in words."""
        if self.time_left_s is None:
            return ''
        if not self.is_low:
            return f'{long_time_text(self.time_left_s)} left at this rate'
        limit = f'at {_exact_size(self.limit_bytes)} free' if self.limit_bytes else \
            'when the disk is full'
        if self.time_left_s > 0.0:
            when = f'in about {long_time_text(max(self.time_left_s, 1.0))}'
            return f'{"Stops" if self.is_recording else "Would stop"} {when}, {limit}'
        return f'Stops now {limit}' if self.is_recording else \
            f'A recording needs {size_text(self.limit_bytes - (self.free_bytes or 0))} more'


def _exact_size(size_bytes: int) -> str:
    """Return a size in words, precise enough to tell the limit from a slightly larger size."""
    return f'{size_bytes / 1e9:.2f}\u2009GB' if 999.5e6 <= size_bytes < 10e9 else \
        size_text(size_bytes)


def disk_room(
    phase: RecordingPhase, snapshot: RecorderSnapshot, seen_bytes: Optional[int]
) -> DiskRoom:
    """Return the room that the recorder reports while recording, else an estimate from its rate.

    ``seen_bytes`` is the free space as the window has seen it itself, if it has.
    """
    if phase is RecordingPhase.RECORDING:
        return DiskRoom(snapshot.free_bytes or seen_bytes, snapshot.time_left_s,
                        _limit_bytes(snapshot), True)
    if seen_bytes is None or snapshot.rate <= 0:
        return DiskRoom(seen_bytes, None)
    return DiskRoom(seen_bytes, max(0, seen_bytes - MIN_FREE_BYTES) / snapshot.rate)


def _limit_bytes(snapshot: RecorderSnapshot) -> int:
    """Return the space that the recorder leaves free, derived from the time that it has left."""
    if not snapshot.time_left_s or snapshot.rate <= 0.0:
        return MIN_FREE_BYTES
    return max(snapshot.free_bytes - round(snapshot.time_left_s * snapshot.rate), 0)
