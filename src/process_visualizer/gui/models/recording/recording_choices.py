# SPDX-License-Identifier: BSD-3-Clause
"""The operator's choices for a recording: its name, its folder, its topics."""
from __future__ import annotations

import os
from enum import Enum
from typing import Dict, List, Mapping, Optional, Sequence

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.model import Device
from process_visualizer.clients.recording_options import RecordingOptions
from process_visualizer.gui.models.playback.newest_call import NewestCall
from process_visualizer.gui.models.recording.bag_target import BagTarget, look_at, stem_of
from process_visualizer.gui.models.recording.topic_ticks import TopicRow, TopicTicks
from process_visualizer.gui.ros.snapshots import TopicSnapshot
from process_visualizer.gui.toolkit.tasks import Tasks


class NameChoice(Enum):
    """The naming of a bag, in the order of the thesis' figure 5.3."""

    DATE = 'date'
    PREFIX = 'prefix'
    NAME = 'name'


class RecordingChoices(QObject):
    """The options of the next recording, and what is in their way on the disk."""

    changed = pyqtSignal()
    topics_changed = pyqtSignal()
    """The list of topics is another one (ticks and rates come with ``changed``)."""
    _looked = pyqtSignal(object)

    def __init__(self, tasks: Tasks, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._ticks = TopicTicks()
        self._looked.connect(self._take_target)
        self._looks = NewestCall(tasks, 'files', self._look_at, lambda: None, self._cannot_look)
        self._target = BagTarget()
        self._settings = {'choice': NameChoice.DATE.value, 'prefix': '', 'name': '',
                          'folder': os.path.expanduser('~/bags')}

    @property
    def name_choice(self) -> NameChoice:
        """Return how the bag gets its name."""
        return NameChoice(self._settings['choice'])

    @property
    def prefix(self) -> str:
        """Return what stands before date and time."""
        return self._settings['prefix']

    @property
    def name(self) -> str:
        """The given name, without .bag."""
        return self._settings['name']

    @property
    def folder(self) -> str:
        """The whole path of the folder for recordings."""
        return self._settings['folder']

    @property
    def problem(self) -> str:
        """Return why folder or name cannot be used, and what to do; '' if they can."""
        if self.name_choice is NameChoice.NAME and not self.name:
            return 'write a name, or choose date and time'
        return self._target.problem

    @property
    def free_name(self) -> str:
        """A name that is free, where the given one is taken; otherwise ''."""
        return self._target.free_name

    @property
    def free_bytes(self) -> Optional[int]:
        """The room on the folder's disk, None where it is not known."""
        return self._target.free_bytes

    @property
    def total_bytes(self) -> Optional[int]:
        """The size of the folder's disk, None where it is not known."""
        return self._target.total_bytes

    @property
    def topics(self) -> List[TopicRow]:
        """The topics of the chosen devices."""
        return self._ticks.rows()

    def choose_name(self, choice: NameChoice) -> None:
        """Choose how the bag gets its name."""
        self._set({'choice': choice.value})

    def set_prefix(self, prefix: str) -> None:
        """Set what stands before date and time."""
        self._set({'prefix': prefix.strip()})

    def set_name(self, name: str) -> None:
        """Set the given name, with or without .bag."""
        self._set({'name': stem_of(name.strip())})

    def set_folder(self, folder: str) -> None:
        """Set the folder for recordings; ~ is the home folder."""
        self._set({'folder': os.path.expanduser(folder.strip())})

    def settings(self) -> Dict[str, str]:
        """Return what is to be remembered until the next start; for ``restore``."""
        return dict(self._settings)

    def restore(self, settings: Mapping[str, str]) -> None:
        """Choose what was remembered; entries that make no sense are left out."""
        known = {key: str(settings[key]) for key in self._settings if settings.get(key)}
        if known.get('choice') not in [choice.value for choice in NameChoice]:
            known.pop('choice', None)
        self._set(known)

    def set_devices(self, devices: Sequence[Device]) -> None:
        """Take the chosen devices, whose topics can be recorded."""
        before = [(row.name, row.device) for row in self.topics]
        self._ticks.set_devices(devices)
        if [(row.name, row.device) for row in self.topics] != before:
            self.topics_changed.emit()
        self.changed.emit()

    def tick(self, topic: str, is_ticked: bool) -> None:
        """Record a topic, or do not."""
        self._ticks.tick(topic, is_ticked)
        self.changed.emit()

    def preset_topics(self) -> None:
        """Tick what the configuration says."""
        self._ticks.preset()
        self.changed.emit()

    def take_topics(self, topics: Sequence[TopicSnapshot]) -> None:
        """Note what the recorder says of the topics; ``changed`` is left to who calls this."""
        self._ticks.take(topics)

    def look(self) -> None:
        """Look at the disk, off the GUI thread; ``changed`` comes if that tells anything new."""
        self._looks.request(self.options())

    def options(self) -> RecordingOptions:
        """The options of the next recording."""
        choice = self.name_choice
        return RecordingOptions(
            topics=self._ticks.ticked(), folder=self.folder,
            prefix=self.prefix if choice is NameChoice.PREFIX else '',
            name=self.name if choice is NameChoice.NAME else '')

    def options_to_save(self, recent_s: float) -> RecordingOptions:
        """The options to save the last seconds; always with date and time, so never in the way."""
        prefix = {NameChoice.DATE: '', NameChoice.PREFIX: self.prefix,
                  NameChoice.NAME: self.name}[self.name_choice]
        return RecordingOptions(folder=self.folder, prefix=prefix, recent_s=recent_s)

    def _set(self, settings: Mapping[str, str]) -> None:
        self._settings.update(settings)
        self._target = self._target._replace(problem='', free_name='')
        self.look()
        self.changed.emit()

    def _look_at(self, options: RecordingOptions) -> None:
        self._looked.emit(look_at(options.folder, options.name, options.prefix))

    def _take_target(self, target: BagTarget) -> None:
        if target != self._target:
            self._target = target
            self.changed.emit()

    def _cannot_look(self, error: Exception) -> None:
        if not isinstance(error, (OSError, ValueError)):
            raise error
        self._take_target(BagTarget(f'{self.folder} cannot be used: {error}; choose another'))
