# SPDX-License-Identifier: BSD-3-Clause
"""Finds, compares, aligns and shares the runs of recordings; keeps which runs are good."""
from __future__ import annotations

import os
from typing import Any, Callable, Dict, FrozenSet, Mapping, NamedTuple, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.model import Mode
from process_visualizer.curves.samples import ReadingCanceled
from process_visualizer.figures import clock_text
from process_visualizer.film import film
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import TaskProgress, Tasks
from process_visualizer.page import export as numbers_export
from process_visualizer.page.robots import PageSpan
from process_visualizer.page.run_page import Judged
from process_visualizer.page.shared_page import ChosenSpans, page_of
from process_visualizer.runs.alignment.alignment import Anchor, with_anchor
from process_visualizer.runs.comparison.comparison import Comparison, incomparable
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.comparison.timeline_bands import (
    AnchoredRun,
    ReferenceMoment,
    TimelineBand,
    timeline_bands,
    timeline_moments,
)
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns, NoCycle
from process_visualizer.runs.run import Key, Run
from process_visualizer.whole_file import write_text

# The part of a comparison that is saved for the next session: enough to repeat the comparison.

RunKey = Tuple[str, str]
"""A run: the path of its recording, and its name."""


AlignedPair = Tuple[RunKey, RunKey]
"""A reference run, and a run that the operator has aligned with it."""
Anchors = Dict[AlignedPair, Tuple[Anchor, ...]]


class KeptComparison(NamedTuple):
    """A saved comparison: the recordings that were read, and the good runs."""

    recording: Tuple[str, ...] = ()
    added: Tuple[str, ...] = ()
    good: FrozenSet[RunKey] = frozenset()
    is_compared: bool = False

    def without_recording(self) -> KeptComparison:
        """Return the same comparison for a window in which no recording is open."""
        return self._replace(recording=(), added=(*self.recording, *self.added))

    def settings(self) -> Dict[str, Any]:
        """Return the input of ``kept_comparison``: numbers, texts, lists and dictionaries."""
        return {'recording': list(self.recording), 'added': list(self.added),
                'good': sorted(map(list, self.good)), 'compared': self.is_compared}


def kept_comparison(settings: Mapping[str, Any]) -> KeptComparison:
    """Return the comparison with these settings.

    Raises:
        KeyError, TypeError, ValueError: these are not settings of a comparison.
    """
    return KeptComparison(
        _texts(settings['recording']), _texts(settings['added']),
        frozenset((str(path), str(name)) for path, name in settings['good']),
        bool(settings['compared']))


def _kept_anchors(settings: Mapping[str, Any]) -> Anchors:
    """Return the operator's alignments; earlier versions saved them with each comparison."""
    rows = list(settings.get('anchors', []))
    for it in settings['comparisons']:
        place = {path: row for row, path in enumerate([*it['recording'], *it['added']])}
        good = sorted(it['good'], key=lambda key: (place.get(key[0], len(place)),
                                                   len(key[1]), key[1]))
        rows += [[*good[0], *row] for row in it.get('anchors', []) if good]
    return {((str(path), str(name)), (str(run_path), str(run_name))):
            tuple(Anchor(float(a), float(b)) for a, b in anchors)
            for path, name, run_path, run_name, anchors in rows}


def _texts(values: Any) -> Tuple[str, ...]:
    if not isinstance(values, list):
        raise TypeError(f'{values!r} is not a list')
    return tuple(str(value) for value in values)


LINE = 'comparison'
_SHARE_LINE = 'share'
SHARED_ENDINGS = ('.html', *film.ENDINGS, *numbers_export.ENDINGS)
"""Endings of the files as which a run can be shared."""
_MAX_KEPT, _MAX_ALIGNED = 50, 500


class ListedRun(NamedTuple):
    """A run and the path of its recording; of a split recording, the path of the first file."""

    path: str
    run: Run

    @property
    def key(self) -> RunKey:
        """Return the key that identifies the run when its recording is read again."""
        return self.path, self.run.name


Comparisons = Tuple[Optional[Comparison], ...]


class Compared(NamedTuple):
    """The good runs, and the comparison of each listed run; None if nothing is in common."""

    good: GoodRuns
    comparisons: Comparisons


class CompareModel(QObject):
    """Finds runs on request, and compares them in the background."""

    changed = pyqtSignal()
    failed = pyqtSignal(str)

    def __init__(self, tasks: Tasks, session: Session, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks, self._session = tasks, session
        self._recording: Tuple[str, ...] = ()
        self._added: Tuple[str, ...] = ()
        self._runs: Tuple[ListedRun, ...] = ()
        self._good: FrozenSet[int] = frozenset()
        self._compared: Optional[Compared] = None
        self._anchors: Anchors = {}  # of all recordings
        self._work: Optional[TaskProgress] = None
        self._is_reading = False  # the current work reads recordings; otherwise it compares runs
        self._activity = ''
        self._writing: Optional[TaskProgress] = None  # continues when another recording is opened
        self._written = ''
        self.shared = ''  # describes the last file that was written
        self._is_asked = True  # the operator asked for the current work
        self._kept: Dict[Tuple[str, ...], KeptComparison] = {}  # by recording
        self._last: Tuple[str, ...] = ()  # the recording of the last session
        self._waiting: Optional[KeptComparison] = None  # waits for the configuration
        self._again: Optional[KeptComparison] = None  # is being restored
        session.cell_changed.connect(self._follow_cell)
        session.recording_changed.connect(self._follow_recording)

    @property
    def recording(self) -> Tuple[str, ...]:
        """The paths of the recording that is open for playback; empty in real-time mode."""
        return self._recording

    @property
    def paths(self) -> Tuple[str, ...]:
        """The recordings whose runs can be found: the open one, and those added."""
        return (*self._recording, *self._added)

    @property
    def runs(self) -> Tuple[ListedRun, ...]:
        """The runs found, in the order of the recordings."""
        return self._runs

    @property
    def good(self) -> FrozenSet[int]:
        """The numbers, from 0, of the runs that the operator has ticked as good."""
        return self._good

    @property
    def compared(self) -> Optional[Compared]:
        """The result; None until runs have been compared."""
        return self._compared

    @property
    def of_recording(self) -> Tuple[Comparison, ...]:
        """Return the comparisons of the runs of the open recording."""
        if self._compared is None:
            return ()
        return tuple(found for it, found in zip(self._runs, self._compared.comparisons)
                     if found is not None and it.path in self._recording[:1])

    @property
    def moments(self) -> Tuple[ReferenceMoment, ...]:
        """The moments of the reference run in the open recording."""
        compared, paths = self._compared, self._recording[:1]
        if compared is None:
            return ()
        return timeline_moments(compared.good.reference, [
            AnchoredRun(number, found, self.anchors(number))
            for number, (it, found) in enumerate(zip(self._runs, compared.comparisons))
            if found is not None and it.path in paths])

    def anchors(self, number: int) -> Tuple[Anchor, ...]:
        """Return the operator's alignment of a run."""
        return self._anchors.get(self._pair(number), ()) if self._good else ()

    def _pair(self, number: int) -> AlignedPair:
        """Return the keys of the reference run (the first good run) and of a run."""
        return self._runs[min(self._good)].key, self._runs[number].key

    @property
    def activity(self) -> str:
        """Return the present activity in words, which ``cancel`` ends; empty if there is none."""
        return self._activity or self._written

    @property
    def is_comparing(self) -> bool:
        """Return whether runs are being found or compared."""
        return self._work is not None

    @property
    def is_writing(self) -> bool:
        """Return whether a run is being written for sharing."""
        return self._writing is not None

    def _follow_cell(self) -> None:
        self._follow_recording()
        self._compare_again(self._waiting)

    def _follow_recording(self) -> None:
        """Compare again if the recording, or the running cell, was compared before.

        The first comparison of the running cell is the one made in playback.
        """
        is_live = self._session.mode is Mode.REALTIME
        paths = () if is_live else self._session.paths
        if paths != self._recording:
            self._stop()
            self._kept = self._with_present()
            left = self._kept.get(self._recording, KeptComparison())
            self._recording, self._added, self._runs = paths, (), ()
            self._good, self._compared = frozenset(), None
            self._compare_again(self._kept.get(paths,
                                               left.without_recording() if is_live else None))
            self.changed.emit()

    def settings(self) -> Dict[str, Any]:
        """Return the input of ``restore``: numbers, texts, lists and dictionaries."""
        newest = list(self._with_present().values())[-_MAX_KEPT:]
        last = self._recording if self._recording or self._runs else self._last
        aligned = list(self._anchors.items())[-_MAX_ALIGNED:]
        return {'comparisons': [it.settings() for it in newest], 'last': list(last),
                'anchors': [[*reference, *run, [list(it) for it in anchors]]
                            for (reference, run), anchors in aligned]}

    def restore(self, settings: Mapping[str, Any]) -> None:
        """Restore the comparisons of earlier sessions, and repeat the last one.

        Raises:
            KeyError, TypeError, ValueError: these are not settings.
        """
        found = [kept_comparison(it) for it in settings['comparisons']]
        self._kept = {it.recording: it for it in found}
        self._anchors = _kept_anchors(settings)
        self._last = tuple(settings['last'])
        last = self._kept.get((), self._kept.get(self._last))
        if last is not None and not self._recording:
            self._compare_again(last.without_recording())

    def add(self, path: str) -> None:
        """Find the runs of another recording too; the runs found before stay unchanged."""
        if any(path in it.run.recording for it in self._runs):
            return
        if path not in self.paths:
            self._added += (path,)
        if not self._runs:
            self.find_runs()
            return
        cell, before = self._session.cell, self._compared
        pairs = dict(self._anchors)
        reference = self._runs[min(self._good)].key if self._good else None

        def found(progress: TaskProgress) -> Tuple[Tuple[ListedRun, ...], Comparisons]:
            runs = _listed(ChosenRuns(cell, progress.is_canceled).runs([path]))
            return runs, () if before is None or reference is None else tuple(_comparison(
                before.good, it.run, pairs.get((reference, it.key), ()), progress) for it in runs)

        self._begin(f'Reading {os.path.basename(path)}…', found,
                    lambda more: self._take_more(before, *more), is_reading=True)

    def find_runs(self) -> None:
        """Read the recordings, and split them into runs; ticked runs stay ticked."""
        cell, recording, added = self._session.cell, self._recording, self._added

        def found(progress: TaskProgress) -> Tuple[ListedRun, ...]:
            chosen = ChosenRuns(cell, progress.is_canceled)
            return _listed([*(chosen.of_recording(recording) if recording else ()),
                            *chosen.runs(added)])

        if recording or added:
            again, self._again = self._again, None
            self._begin('Reading the recordings…', found,
                        lambda runs: self._take_runs(runs, again or self._present()),
                        is_reading=True, is_asked=again is None)

    def set_good(self, number: int, is_good: bool) -> None:
        """Set whether a run is good; this cancels a comparison with the previous good runs."""
        good = self._good | {number} if is_good else self._good - {number}
        if good != self._good:
            if not self._is_reading:
                self._stop()
            self._good, self._compared = good, None
            self.changed.emit()

    def compare(self) -> None:
        """Compare all runs with the good ones; the first good run is the reference run."""
        runs, good = [it.run for it in self._runs], sorted(self._good)
        anchors = [self.anchors(number) for number in range(len(runs))]

        def compared(progress: TaskProgress) -> Compared:
            reference, *others = [runs[number] for number in good]
            band = GoodRuns(reference, others)
            return Compared(band, tuple(
                _comparison(band, run, said, progress) for run, said in zip(runs, anchors)))

        if good:
            self._begin(f'Comparing {len(runs)} runs…', compared, self._take_compared)

    def anchor(self, moment: ReferenceMoment, position_s: float) -> None:
        """Align a moment of the reference run with a position [s] in the open recording."""
        run = self._runs[moment.run].run
        run_s = min(max(position_s - run.begin_s, 0.0), run.duration_s)
        self._align_again(moment.run, with_anchor(self.anchors(moment.run),
                                                  Anchor(moment.reference_s, run_s)))

    def reset_anchors(self, number: int) -> None:
        """Align a run again without the operator's anchors."""
        self._align_again(number, ())

    def shared_span(self, number: int) -> PageSpan:
        """Return the part of a run to share: A to B while the player's loop is on."""
        listed, player = self._runs[number], self._session.player
        is_played = player is not None and listed.path in self._recording[:1]
        return shared_span(listed.run, player.loop if player is not None and is_played else None)

    def share(self, listed: ListedRun, span: PageSpan, path: str) -> None:
        """Write a part of a listed run; ``failed`` says so if it is no longer listed.

        ``path`` has one of SHARED_ENDINGS, which selects page, film, table or MCAP. Writing
        continues when another recording is opened.
        """
        number = next((row for row, it in enumerate(self._runs) if it is listed), None)
        if number is None:
            self.failed.emit(f'{os.path.basename(path)} was not written: the runs have changed. '
                             f'Choose {listed.run.name} in the list and share it again')
            return
        self._stop_writing()
        cell, compared = self._session.cell, self._compared
        comparison = None if compared is None else compared.comparisons[number]

        progress = self._writing = TaskProgress(self)

        def work() -> str:
            good = None if compared is None or comparison is None else compared.good
            judged = Judged(listed.run) if good is None else Judged(
                listed.run, comparison, good.of(listed.run) or good)
            said = _write_shared(path, ChosenSpans(cell, [listed.run], [span], good, (judged,)),
                                 progress)
            return (f'{os.path.basename(path)} was written: {listed.run.name} from '
                    f'{clock_text(span.begin_s)} to {clock_text(span.end_s)}, {said}.')

        def refuse(error: Exception) -> None:
            if progress is not self._writing or isinstance(error, ReadingCanceled):
                return
            self._end_writing(progress, '')
            if not isinstance(error, (BagError, ConfigurationError, ValueError, OSError)):
                raise error
            self.failed.emit(f'{os.path.basename(path)} cannot be written: {error}')

        written = self._written = f'Writing {os.path.basename(path)}…'
        self.shared = ''
        progress.changed.connect(lambda part: self._take_written(progress, written, part))
        self._tasks.run(_SHARE_LINE, work, lambda text: self._end_writing(progress, text), refuse)
        self.changed.emit()

    def _take_written(self, progress: TaskProgress, written: str, part: float) -> None:
        if progress is self._writing:
            self._written = f'{written} {100.0 * part:.0f} %'
            self.changed.emit()

    def _end_writing(self, progress: TaskProgress, text: str) -> None:
        if progress is self._writing:
            self._writing, self._written, self.shared = None, '', text
            self.changed.emit()

    def _stop_writing(self) -> None:
        if self._writing is not None:
            self._writing.cancel()
        self._writing, self._written = None, ''

    def _align_again(self, number: int, anchors: Tuple[Anchor, ...]) -> None:
        before = self._compared
        if before is None:
            return
        pair = self._pair(number)
        self._anchors.pop(pair, None)
        if anchors:
            self._anchors[pair] = anchors
        runs = [it.run for it in self._runs]
        wanted = [self.anchors(row) for row in range(len(runs))]

        def compared(_progress: TaskProgress) -> Compared:
            return before._replace(comparisons=tuple(
                before.good.compare(runs[row], wanted[row])
                if comparison is not None and (row == number or wanted[row]) else comparison
                for row, comparison in enumerate(before.comparisons)))

        self._begin(f'Aligning {runs[number].name}…', compared, self._take_compared)

    def cancel(self) -> None:
        """Cancel the work that ``activity`` names."""
        if not self.is_comparing:
            self._stop_writing()
        self._stop()
        self.changed.emit()

    def close(self) -> None:
        """Cancel all work."""
        self._stop_writing()
        self._stop()

    def _begin(self, activity: str, work: Callable[[TaskProgress], Any],
               take: Callable[[Any], None], is_reading: bool = False,
               is_asked: bool = True) -> None:
        self._stop()
        self._is_reading, self._is_asked = is_reading, is_asked
        self._activity, self._work = activity, TaskProgress(self)
        progress = self._work
        progress.changed.connect(lambda part: self._take_progress(progress, activity, part))
        self._tasks.run(LINE, lambda: work(progress), lambda result: self._end(progress, take,
                                                                               result),
                        lambda error: self._refuse(progress, error))
        self.changed.emit()

    def _take_progress(self, progress: TaskProgress, activity: str, part: float) -> None:
        if progress is self._work:
            self._activity = f'{activity} {100.0 * part:.0f} %'
            self.changed.emit()

    def _stop(self) -> None:
        if self._work is not None:
            self._work.cancel()
        self._work, self._activity, self.shared = None, '', ''

    def _end(self, progress: TaskProgress, take: Callable[[Any], None], result: Any) -> None:
        if progress is self._work:
            self._work, self._activity = None, ''
            take(result)
            self.changed.emit()

    def _take_runs(self, runs: Tuple[ListedRun, ...], kept: KeptComparison) -> None:
        self._runs, self._compared = runs, None
        self._good = frozenset(row for row, it in enumerate(runs) if it.key in kept.good)
        if kept.is_compared:
            self.compare()

    def _take_more(self, before: Optional[Compared], runs: Tuple[ListedRun, ...],
                   comparisons: Comparisons) -> None:
        """Add the runs of another recording; their comparisons only if the ticks are unchanged."""
        self._runs += runs
        if before is not None and self._compared is before:
            self._compared = before._replace(comparisons=(*before.comparisons, *comparisons))

    def _compare_again(self, kept: Optional[KeptComparison]) -> None:
        """Repeat a saved comparison as soon as the configuration is known."""
        self._waiting = kept if self._session.cell is None else None
        if kept is not None and self._session.cell is not None:
            self._added, self._again = kept.added, kept
            self.find_runs()

    def _with_present(self) -> Dict[Tuple[str, ...], KeptComparison]:
        """Return the saved comparisons; the current one is the newest."""
        if not self._runs:
            return self._kept
        kept = {key: it for key, it in self._kept.items() if key != self._recording}
        if self._good or not self._recording:
            present = self._present()
            kept[self._recording] = present._replace(
                is_compared=present.is_compared or bool(self._activity))
        return kept

    def _present(self) -> KeptComparison:
        """Return the current comparison."""
        return KeptComparison(self._recording, self._added,
                              frozenset(self._runs[row].key for row in self._good),
                              self._compared is not None)

    def _take_compared(self, compared: Compared) -> None:
        self._compared = compared

    def _refuse(self, progress: TaskProgress, error: Exception) -> None:
        if progress is not self._work or isinstance(error, ReadingCanceled):
            return
        self._work, self._activity = None, ''
        if not self._is_asked and isinstance(error, NoCycle):
            self._added = ()  # for another configuration; with that one they are read again
            self.changed.emit()
            return
        if self._is_reading:
            self._forget_unread()
        self.changed.emit()
        if not isinstance(error, (BagError, ConfigurationError, ValueError, OSError)):
            raise error
        self.failed.emit(f'The runs cannot be compared: {error}')

    def _forget_unread(self) -> None:
        """Keep the added recordings whose runs are listed; without runs, all but the last one.

        The last one may be the unreadable one.
        """
        listed = {it.path for it in self._runs}
        self._added = (tuple(it for it in self._added if it in listed) if listed
                       else self._added[:-1])
        self._kept.pop(self._recording, None)
        self._last = ()


def _listed(runs: Sequence[Run]) -> Tuple[ListedRun, ...]:
    return tuple(ListedRun(run.recording[0], run) for run in runs)


def _write_shared(path: str, chosen: ChosenSpans, progress: TaskProgress) -> str:
    """Write a run in the format of the path's ending; return the size of the result in words."""
    def on_frame(done: int, count: int) -> None:
        if progress.is_canceled():
            raise ReadingCanceled
        if 100 * done // count != 100 * (done - 1) // count:
            progress.report(done / count)

    ending = os.path.splitext(path)[1].lower()
    if ending in film.ENDINGS:
        return f'{film.write_film(path, chosen, film.Style(), on_frame=on_frame)} frames'
    if ending in numbers_export.ENDINGS:
        return numbers_export.export(path, chosen)
    write_text(path, page_of(chosen))
    return f'{os.path.getsize(path) / 1e6:.1f} MB'


def shared_span(run: Run, loop: Optional[Tuple[float, float]]) -> PageSpan:
    """Return the part of a recording [s] to share: the run, or its part within the loop."""
    begin_s, end_s = run.begin_s, run.begin_s + run.duration_s
    if loop is not None and max(begin_s, loop[0]) < min(end_s, loop[1]):
        return PageSpan(max(begin_s, loop[0]), min(end_s, loop[1]))
    return PageSpan(begin_s, end_s)


def _comparison(good: GoodRuns, run: Run, anchors: Sequence[Anchor],
                progress: TaskProgress) -> Optional[Comparison]:
    if progress.is_canceled():
        raise ReadingCanceled
    return None if incomparable(good.reference, run) else good.compare(run, anchors)


BANDS_LINE = 'bands'
_Wanted = Tuple[Optional[Compared], float, int]


class BandsModel(QObject):
    """Computes bands in the background, since an hour of curves has very many columns."""

    changed = pyqtSignal()

    def __init__(self, tasks: Tasks, compare: CompareModel,
                 parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._tasks, self._compare = tasks, compare
        self._bands: Mapping[Key, TimelineBand] = {}
        self._wanted: _Wanted = (None, 0.0, 0)
        compare.changed.connect(lambda: self._want((compare.compared, *self._wanted[1:])))

    @property
    def bands(self) -> Mapping[Key, TimelineBand]:
        """The bands by device and label; empty until they have been computed."""
        return self._bands

    def set_columns(self, duration_s: float, columns: int) -> None:
        """Set the number of equally long columns of the curves; 0 without curves."""
        self._want((self._wanted[0], duration_s, columns))

    def _want(self, wanted: _Wanted) -> None:
        compared, duration_s, columns = wanted
        if compared is self._wanted[0] and (duration_s, columns) == self._wanted[1:]:
            return
        self._wanted = wanted
        self._take(wanted, {})  # the old bands are of other runs or have other columns
        if compared is not None and columns:
            runs = self._compare.of_recording
            self._tasks.run(BANDS_LINE,
                            lambda: timeline_bands(runs, duration_s, columns),
                            lambda bands: self._take(wanted, bands))

    def _take(self, wanted: _Wanted, bands: Mapping[Key, TimelineBand]) -> None:
        if wanted is self._wanted and (bands or self._bands):
            self._bands = bands
            self.changed.emit()
