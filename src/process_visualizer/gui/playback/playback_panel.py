# SPDX-License-Identifier: BSD-3-Clause
"""The panel of playback: the recording, the buttons, and the timeline."""
from __future__ import annotations

from dataclasses import replace
from typing import Dict, Optional, Sequence, Tuple

from PyQt5.QtWidgets import (
    QHBoxLayout,
    QInputDialog,
    QProgressBar,
    QSizePolicy,
    QToolButton,
    QWidget,
)

from process_visualizer.curves.curves import Curve
from process_visualizer.curves.position_values import Key, key_of
from process_visualizer.figures import clock_text
from process_visualizer.gui.compare.compare_model import BandsModel
from process_visualizer.gui.lanes.curves_dialog import CurvesDialog
from process_visualizer.gui.lanes.lanes_timeline import framed
from process_visualizer.gui.lanes.timeline_header import Alarms
from process_visualizer.gui.lanes.timeline_lanes import Lane, grouped_lanes, lane_label, lane_of
from process_visualizer.gui.playback.bag_model import BagModel, CurvesModel, placed_gaps
from process_visualizer.gui.playback.bag_view import BagView
from process_visualizer.gui.playback.playback_model import PlaybackModel
from process_visualizer.gui.playback.timeline_view import TimelineView
from process_visualizer.gui.playback.transport_view import TransportView
from process_visualizer.gui.playback.values_model import ValuesModel
from process_visualizer.gui.toolkit.labels import plain_label, plain_tip
from process_visualizer.gui.toolkit.theme import set_sheet
from process_visualizer.gui.toolkit.widgets import MeaningGuard, in_column
from process_visualizer.health.device_state import Level
from process_visualizer.health.near_objects import NearSpan, times


class CurvesRow(QWidget):
    """The progress of reading curves; visible only while curves are read or after canceling."""

    def __init__(self, curves: CurvesModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._curves = curves
        self._shown: Optional[object] = None
        self.text = plain_label()
        self.bar = QProgressBar()
        self.bar.setObjectName('curves_progress')
        self.bar.setRange(0, 1000)
        self.bar.setTextVisible(False)
        self.bar.setMaximumHeight(8)
        self.button = QToolButton()
        self.button.setObjectName('curves_button')
        self.button.setAutoRaise(True)
        self.button.clicked.connect(self._on_button)
        self._meaning = MeaningGuard(self.button)
        self.setSizePolicy(QSizePolicy.Preferred, QSizePolicy.Fixed)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(12, 2, 12, 2)
        for widget, stretch in ((self.text, 0), (self.bar, 1), (self.button, 0)):
            layout.addWidget(widget, stretch)
        curves.changed.connect(self._show)
        self._show()

    def _on_button(self) -> None:
        if self._curves.reading is not None:
            self._curves.cancel()
        else:
            self._curves.read()

    def _show(self) -> None:
        progress = self._curves.reading
        self.setVisible(progress is not None or self._curves.is_canceled)
        self.text.setText('Reading curves' if progress is not None else 'No curves')
        self.button.setText('Cancel' if progress is not None else 'Read them')
        self._meaning.show('cancel' if progress is not None else 'read')
        self.button.setToolTip('Play without curves' if progress is not None
                               else 'Read the curves of the process variables')
        self.bar.setVisible(progress is not None)
        if progress is not None and progress is not self._shown:
            self.bar.setValue(0)
            progress.changed.connect(lambda part: self.bar.setValue(round(1000 * part)))
        self._shown = progress


class PlaybackPanel(QWidget):
    """The panel of playback mode, from top to bottom.

    ``below`` is the part with the buttons and the timeline; it can move to a wider place.
    """

    def __init__(self, playback: PlaybackModel, bag: BagModel, values: ValuesModel,
                 bands: BandsModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._playback = playback
        self._bag = bag
        self.bag = BagView(bag)
        self.transport = TransportView(playback)
        self.timeline = TimelineView(playback, values.value, bag.curves.choices)
        self.curves = CurvesRow(bag.curves)
        self._lanes: Dict[Key, Lane] = {}
        self._bands = bands
        self._near: Tuple[NearSpan, ...] = ()
        self.notes = plain_label()
        self.notes.setObjectName('playback_notes')
        self.notes.setWordWrap(True)
        set_sheet(self.notes, 'color: <warning>')
        self.setObjectName('playback_panel')
        self._lay_out()
        bag.changed.connect(self._show_bag)
        bag.curves.changed.connect(self._show_curves)
        values.changed.connect(self.timeline.show_values)
        self.timeline.mark_wanted.connect(self.ask_for_mark)
        self.timeline.curves_wanted.connect(self.ask_for_curves)
        bag.curves.choices.changed.connect(self._show_lanes)
        bands.changed.connect(self._show_lanes)
        playback.changed.connect(self._show_notes)
        self._show_bag()
        self._show_curves()
        self._show_notes()

    def _lay_out(self) -> None:
        frame = framed(self.timeline, self.curves)
        self.below = QWidget()
        below = in_column(self.below, 8, self.transport, frame)
        below.setStretchFactor(frame, 1)
        below.addStretch(0)
        layout = in_column(self, 8, self.bag, self.notes, self.below)
        layout.setContentsMargins(0, 6, 0, 0)
        layout.setStretchFactor(self.below, 1)
        layout.addStretch(0)

    def ask_for_mark(self, position_s: float) -> None:
        """Ask for the label of a mark at a time [s], and add it to the recording."""
        dialog = QInputDialog(self)
        dialog.setObjectName('mark_label')
        dialog.setWindowTitle('Add a mark')
        dialog.setLabelText(f'Mark label at {clock_text(position_s, 3)}:')
        dialog.textValueSelected.connect(
            lambda label: self._bag.add_mark(position_s, label.strip() or 'mark'))
        dialog.open()

    def ask_for_curves(self) -> None:
        """Open the dialog for the choice of curves."""
        CurvesDialog(tuple(self._lanes.values()), self._bag.curves.choices, self).open()

    def set_near(self, spans: Sequence[NearSpan]) -> None:
        """Set the spans of the recording in which objects were near robots."""
        if tuple(spans) != self._near:
            self._near = tuple(spans)
            self._show_alarms()

    def _show_alarms(self) -> None:
        beyond = tuple((it.begin_s, it.end_s) for it in self._bag.curves.alarms)
        self.timeline.alarms = Alarms(beyond + times(self._near, Level.BAD),
                                      times(self._near, Level.WARNING))
        self.timeline.update()

    def _show_bag(self) -> None:
        found = self._bag.session.recording
        self.timeline.set_recording(0.0 if found is None else found.duration_s, placed_gaps(found))
        self.transport.set_topics(() if found is None else found.topic_names)

    def _show_notes(self) -> None:
        """Show problems of the player, and dropped messages."""
        state = self._playback.state
        notes = list(state.problems)
        if state.dropped:
            notes.append(f'{state.dropped} messages were dropped for slow subscribers')
        self.notes.setVisible(bool(notes))
        more = f'  (and {len(notes) - 1} more)' if len(notes) > 1 else ''
        self.notes.setText(notes[-1] + more if notes else '')
        self.notes.setToolTip(plain_tip('\n'.join(notes)))

    def _show_curves(self) -> None:
        found = self._bag.session.recording
        self._show_alarms()
        lanes = [] if found is None else [
            _lane(curve, found.duration_s) for curve in self._bag.curves.curves]
        self._lanes = {lane.key: lane for lane in lanes}
        self._bands.set_columns(0.0 if found is None else found.duration_s,
                                max((len(lane.low) for lane in lanes), default=0))
        self._show_lanes()

    def _show_lanes(self) -> None:
        bands = {key: self._bands.bands.get(_band_key(key)) for key in self._lanes}
        curves = {key: lane if bands[key] is None else replace(lane, band=bands[key])
                  for key, lane in self._lanes.items()}
        self.timeline.set_lanes(grouped_lanes(curves, self._bag.curves.choices.choice))


def _band_key(key: Key) -> Tuple[str, str]:
    """Return the device and the label of the channel of a run."""
    device, label, _topic = key
    return device, {'v': 'tool speed', 'F': 'tool force'}.get(label, label)


def _lane(curve: Curve, duration_s: float) -> Lane:
    label = lane_label(curve.device, curve.label)
    return replace(lane_of(label, curve.unit, curve.color, curve.low, curve.high,
                           duration_s / max(len(curve.low), 1)),
                   key=key_of(curve.device, curve.label, curve.topic), limits=curve.limits)
