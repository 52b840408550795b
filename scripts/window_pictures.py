# SPDX-License-Identifier: BSD-3-Clause
"""Drives the launcher through all its states, and takes a picture of each.

usage: window_pictures.py CONFIG FOLDER    (started by take_window_pictures)
"""
from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from typing import Any, Callable, List, cast
from xmlrpc.client import ServerProxy

import rosgraph
from PyQt5.QtCore import QEventLoop, QTimer
from PyQt5.QtWidgets import (
    QAbstractButton,
    QApplication,
    QDialog,
    QLabel,
    QScrollArea,
    QWidget,
)

from process_visualizer.cell.model import Mode, Pose
from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.app.launcher_app import LauncherApp
from process_visualizer.gui.app.main import make_application
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.app.window_keeper import WindowKeeper
from process_visualizer.gui.live.replay_model import ReplayPhase

_PERIOD_MS = 20
_REPLAYED_S = 8.0
_RECORDED_S = 20.0
_TYPOS = (('type="robot" name="ur_rt_lower"', 'type="robt" name="ur_rt_lower"'),
          ('0.09 1.90', '0.09 1,90'), ('record="False"', 'record="Flase"'))


class Photographer:
    """Takes pictures of the whole screen, or of the window only."""

    def __init__(self, config: str, folder: Path) -> None:
        self._app = make_application()
        self._config, self._folder = config, folder
        self._settings = Settings()
        self.launcher = Launcher()
        self.window = LauncherApp(self.launcher, self._settings)
        WindowKeeper(self.window, self.launcher, self._settings)
        self.window.show()
        QApplication.setActiveWindow(self.window)
        self.launcher.begin()

    def take_all(self) -> None:
        """Go through every state."""
        self._start()
        self._replay()
        bag = self._real_time()
        self._problems()
        self._playback(bag)
        self._play_poor_seam(self._record_poor_seam())
        self._near_object()

    def close(self) -> None:
        """End everything that was started."""
        self.window.leave()
        self._until(lambda: not self.window.isVisible(), 60.0)
        self.launcher.close()

    # The states

    def _start(self) -> None:
        self.launcher.cell.open(self._config)
        self._until(self.window.launch.launch.isEnabled, 60.0)
        self._picture('start')

    def _real_time(self) -> str:
        """Launch, record, calibrate, and let a node die; return the path of the bag."""
        launcher, folder = self.launcher, os.environ['ROS_HOME']
        displays: List[bool] = []
        launcher.link.displays.connect(
            lambda found: displays.append(all(it.level == 0 for it in found)))
        self._click('launch')
        self._until(lambda: bool(displays) and displays[-1], 120.0)
        self._pause(4.0)
        self._picture('realtime', whole=True)
        launcher.recording.choices.set_folder(folder)
        self._until(self._button('record').isEnabled, 30.0)
        self._click('record')
        self._until(lambda: launcher.recording.elapsed_s > _RECORDED_S / 4, 60.0)
        launcher.recording.set_label('leather in')
        self._click('mark')
        self._until(lambda: launcher.recording.elapsed_s > _RECORDED_S * 3 / 4, 60.0)
        launcher.recording.set_label('seam begins')
        self._click('mark')
        self._until(lambda: launcher.recording.elapsed_s > _RECORDED_S, 60.0)
        self._picture('recording')
        self._picture('live', whole=True)
        self._click('record')
        self._until(lambda: not launcher.recording.is_recording, 30.0)
        self._pause(1.0)
        self._picture('recorded')
        self._calibrate()
        self._let_a_node_die()
        self._quit()
        return str(next(Path(folder).glob('*.bag')))

    def _replay(self) -> None:
        """Look back, without the Kinect: its images slow down software rendering."""
        launcher, replay = self.launcher, self.launcher.replay
        launcher.cell.tick('kinect', False)
        self._click('launch')
        self._until(lambda: launcher.live.window is not None
                    and launcher.live.window.begin_s > 0.0, 120.0)
        self.window.live.timeline.replay_wanted.emit(-_REPLAYED_S)
        self._until(lambda: replay.phase is ReplayPhase.SHOWN, 120.0)
        self._pause(6.0)
        self._picture('replay', whole=True)
        self._quit()
        launcher.cell.tick('kinect', True)

    def _calibrate(self) -> None:
        self.window.panels.setCurrentWidget(self.window.calibration)
        self._click('calibration_marker')
        model = self.launcher.calibration
        model.set_value(0, model.pose.xyz[0] + 0.025)
        model.set_value(3, model.pose.ypr[0] + 0.05)
        self._pause(2.5)
        self._picture('calibration', whole=True)
        model.revert()
        self._click('calibration_marker')
        self.window.panels.setCurrentIndex(0)

    def _let_a_node_die(self) -> None:
        uri = rosgraph.Master('/pictures').lookupNode('/sewing_machine/sewing_machine')
        pid = cast(List[Any], ServerProxy(uri).getPid('/pictures'))[2]
        os.kill(pid, signal.SIGKILL)
        device = self.window.devices
        self._until(lambda: device.state_text('sewing_machine') != 'running', 20.0)
        device.topLevelItem(3).setExpanded(True)
        self._pause(1.0)
        self._picture('died')
        device.topLevelItem(3).setExpanded(False)

    def _problems(self) -> None:
        """Show a file with mistakes that was changed while it was open."""
        config, cell = Path(self._config), self.launcher.cell
        good = broken = config.read_text(encoding='utf-8')
        for right, wrong in _TYPOS:
            broken = broken.replace(right, wrong)
        config.write_text(broken, encoding='utf-8')
        cell.reload()
        self._until(lambda: bool(cell.problems), 20.0)
        self._picture('problems')
        config.write_text(good, encoding='utf-8')
        cell.reload()
        self._until(lambda: not cell.problems, 20.0)

    def _playback(self, bag: str) -> None:
        launcher, playback = self.launcher, self.launcher.playback
        launcher.session.set_mode(Mode.PLAYBACK)
        self._pause(0.5)
        self._picture('playback_empty')
        launcher.bag.open([bag])
        self._until(lambda: launcher.session.paths == (bag,)
                    and bool(launcher.bag.curves.curves), 60.0)
        self._click('launch')
        self._until(lambda: playback.state.is_available and launcher.launch.is_running,
                    120.0)
        self._until(lambda: playback.state.is_playing, 60.0)
        self._until(lambda: playback.position_s > 8.0, 30.0)
        playback.toggle()
        self._until(lambda: not playback.state.is_playing, 20.0)
        self._pause(2.0)
        self._picture('playback', whole=True)
        self._fit()
        playback.set_rate(0.5)
        playback.set_loop_begin(10.0)
        playback.set_loop_end(14.0)
        playback.seek(10.5)
        playback.play()
        self._until(lambda: playback.state.is_playing and playback.position_s > 11.5, 30.0)
        self._picture('loop', whole=True)
        self._button('bag_details').click()
        self._pause(0.5)
        self._picture('topics')
        self._button('bag_details').click()
        self._click('show_keys')
        self._pause(0.5)
        self._picture('keys')
        self._close_dialogs()
        self._quit()

    def _fit(self) -> None:
        """Fit the Kinect, whose configured pose is wrong by 20 mm and 2°."""
        model, fit = self.launcher.calibration, self.launcher.calibrating.fit
        self.window.panels.setCurrentWidget(self.window.calibration)
        model.choose('kinect')
        x, y, z = model.pose.xyz
        yaw, pitch, roll = model.pose.ypr
        model.set_pose('kinect', Pose((x + 0.012, y - 0.016, z), (yaw, pitch - 0.035, roll)))
        self._pause(2.0)
        self._click('calibration_fit')
        self._until(lambda: not fit.is_fitting, 60.0)
        self._pause(2.0)
        column = self.window.centralWidget()
        assert isinstance(column, QScrollArea)
        column.ensureWidgetVisible(self._button('calibration_keep'))
        self._pause(0.5)
        self._picture('fit', whole=True)
        model.revert()
        self.window.panels.setCurrentIndex(0)

    def _record_poor_seam(self) -> str:
        """Record until a limit has been left and kept again; return the path of the bag."""
        launcher, before = self.launcher, self.launcher.session.devices
        launcher.cell.open(self._config, {'quality': 'poor'})
        self._until(lambda: launcher.session.devices is not before, 20.0)
        launcher.cell.tick('kinect', False)
        launcher.session.set_mode(Mode.REALTIME)
        self._until(self.window.launch.launch.isEnabled, 60.0)
        self._click('launch')
        self._until(self._button('record').isEnabled, 120.0)
        self._click('record')
        self._until(self._is_beyond_a_limit, 120.0)
        self._picture('alarm', whole=True)
        self._until(lambda: not self._is_beyond_a_limit(), 60.0)
        self._pause(2.0)
        path = launcher.recording.state.path
        self._click('record')
        self._until(lambda: not launcher.recording.is_recording, 30.0)
        self._quit()
        return path

    def _is_beyond_a_limit(self) -> bool:
        return any(' edge is ' in it.condition.text for it in self.launcher.alarms.alarms)

    def _play_poor_seam(self, bag: str) -> None:
        launcher, playback = self.launcher, self.launcher.playback
        launcher.session.set_mode(Mode.PLAYBACK)
        launcher.bag.open([bag])
        self._until(lambda: launcher.session.paths == (bag,)
                    and bool(launcher.bag.curves.alarms), 60.0)
        self._click('launch')
        self._until(lambda: playback.state.is_available and launcher.launch.is_running,
                    120.0)
        playback.pause()
        alarm = launcher.bag.curves.alarms[0]
        playback.seek(0.5 * (alarm.begin_s + alarm.end_s))
        self._until(self._is_beyond_a_limit, 30.0)
        self._pause(3.0)
        self._picture('poor_seam', whole=True)
        self._quit()

    def _near_object(self) -> None:
        """Show a hand that comes near a robot: live, and in a recording of it."""
        launcher, before = self.launcher, self.launcher.session.devices
        launcher.cell.open(self._config, {'objects': 'true', 'intruder': 'hand'})
        self._until(lambda: launcher.session.devices is not before, 20.0)
        launcher.cell.tick('kinect', True)
        launcher.session.set_mode(Mode.REALTIME)
        self._until(self.window.launch.launch.isEnabled, 60.0)
        self._click('launch')
        self._until(self._is_something_near, 120.0)
        self._click('record')
        self._until(lambda: launcher.recording.elapsed_s > _RECORDED_S / 4, 60.0)
        self._until(self._is_something_near, 120.0)
        self._picture('object', whole=True)
        path = launcher.recording.state.path
        self._click('record')
        self._until(lambda: not launcher.recording.is_recording, 30.0)
        self._quit()
        self._play_near_object(path)

    def _play_near_object(self, bag: str) -> None:
        launcher, playback = self.launcher, self.launcher.playback
        launcher.session.set_mode(Mode.PLAYBACK)
        launcher.bag.open([bag])
        self._until(lambda: launcher.session.paths == (bag,), 60.0)
        self._click('launch')
        self._until(lambda: playback.state.is_available and launcher.launch.is_running,
                    120.0)
        self._until(self._is_something_near, 120.0)
        self._pause(1.0)
        playback.pause()
        self._pause(3.0)
        self._picture('object_played', whole=True)
        self._quit()

    def _is_something_near(self) -> bool:
        return bool(self.launcher.objects.model.conditions)

    # How it is done

    def _quit(self) -> None:
        self.launcher.launch.quit()
        self._until(lambda: self.launcher.launch.is_idle, 90.0)

    def _picture(self, name: str, whole: bool = False) -> None:
        """Save a picture of the whole screen, or of the window."""
        self._pause(0.3)
        dialog = next((it for it in self.window.findChildren(QDialog) if it.isVisible()), None)
        shown = dialog if dialog is not None else self.window
        picture = (self._app.primaryScreen().grabWindow(0) if whole else shown.grab())
        if not picture.save(str(self._folder / f'launcher_{name}.png')):
            raise OSError(f'{self._folder} cannot be written')
        print(name, flush=True)

    def _close_dialogs(self) -> None:
        for dialog in self.window.findChildren(QDialog):
            dialog.close()

    def _button(self, name: str) -> QAbstractButton:
        found: QAbstractButton = self.window.findChild(QAbstractButton, name)
        return found

    def _click(self, name: str) -> None:
        self._button(name).click()

    def _text(self, name: str) -> str:
        label: QLabel = self.window.findChild(QLabel, name)
        return str(label.text())

    def _pause(self, seconds: float) -> None:
        loop = QEventLoop()
        QTimer.singleShot(round(1000 * seconds), loop.quit)
        loop.exec_()

    def _until(self, condition: Callable[[], bool], timeout_s: float) -> None:
        """Process events until a condition is true; raise TimeoutError otherwise."""
        loop, timer, end = QEventLoop(), QTimer(), QTimer()
        end.setSingleShot(True)
        end.timeout.connect(loop.quit)
        end.start(round(1000 * timeout_s))
        timer.timeout.connect(lambda: loop.quit() if condition() else None)
        timer.start(_PERIOD_MS)
        loop.exec_()
        if not condition():
            message = self.window.findChild(QWidget, 'message')
            raise TimeoutError(f'not seen; status: {self._text("status")}; '
                               f'{message.text() if message is not None else ""}')


def main() -> None:
    """Take the pictures."""
    photographer = Photographer(sys.argv[1], Path(sys.argv[2]))
    try:
        photographer.take_all()
    finally:
        photographer.close()


if __name__ == '__main__':
    main()
