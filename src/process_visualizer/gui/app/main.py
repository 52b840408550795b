# SPDX-License-Identifier: BSD-3-Clause
"""The program ``gui``: the launcher with its window, which unexpected errors do not end."""
from __future__ import annotations

import argparse
import html
import logging
import os
import re
import signal
import socket
import sys
import threading
import traceback
from logging.handlers import RotatingFileHandler
from types import TracebackType
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple, Type

import rospkg
from PyQt5.QtCore import QObject, QSize, QSocketNotifier, Qt, pyqtSignal
from PyQt5.QtWidgets import QApplication, QWidget

from process_visualizer.cell.model import Mode
from process_visualizer.generate.choice import Viewers
from process_visualizer.gui.app.kept_state import FILE_NAME, KeptState
from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.app.launcher_app import LauncherApp
from process_visualizer.gui.app.look_on import SecondLauncher
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.app.watchdog import watch_if_wanted
from process_visualizer.gui.app.window_keeper import WindowKeeper
from process_visualizer.gui.ros.ros_link import NODE
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.dialogs import TextDialog, show_aside
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.labels import plain_label
from process_visualizer.gui.toolkit.theme import DesktopTheme, apply_style
from process_visualizer.launching.cell_owner import CellOwner, cell_owner
from process_visualizer.launching.real_time_advice import give_real_time_advice
from process_visualizer.launching.x_display import NoDisplay, require_display
from process_visualizer.remote.link_words import not_this_computer, ports_of
from process_visualizer.remote.offer import DEFAULT_PORTS

_NAMED_VALUE = re.compile('[A-Za-z]\\w*:=')

_NO_SHARED_PICTURE = 'QT_XCB_NO_MITSHM'
"""Environment variable of Qt. Without it, each paint waits until the X server has read the last
picture from shared memory, which takes long while the server is busy with RViz."""


def main() -> int:
    """Run the launcher; return its exit code."""
    words = [word for word in sys.argv[1:] if not word.startswith('__')]  # roslaunch's own
    options = _options([word for word in words if not _NAMED_VALUE.match(word)])
    arguments = dict(word.split(':=', 1) for word in words if _NAMED_VALUE.match(word))
    give_real_time_advice(print)
    wrong_address = not_this_computer(os.environ)
    if wrong_address is not None:
        print(wrong_address, file=sys.stderr, flush=True)
    try:
        require_display('; "cell run --no-rviz" needs none')
    except NoDisplay as error:
        print(error, file=sys.stderr, flush=True)
        return 1
    app = make_application()
    owner = cell_owner(NODE)
    if owner is not None:
        return _watch(app, owner)
    settings = Settings()
    launcher = Launcher()
    launcher.failed.connect(lambda message: print(message, file=sys.stderr, flush=True))
    window = LauncherApp(launcher, settings)
    install_hooks(window)
    watcher = watch_if_wanted(app)
    signals = StopSignals(app)
    signals.received.connect(window.leave)
    keeper = WindowKeeper(window, launcher, settings)
    window.show()
    if settings.problem:
        launcher.failed.emit(settings.problem)
    kept = KeptState(os.path.join(settings.folder, FILE_NAME), launcher.tasks, launcher.restore,
                     launcher.settings, launcher)
    kept.failed.connect(launcher.failed)
    kept.restore()
    for changed in (launcher.cell.changed, launcher.compare.changed, launcher.unsaved.changed,
                    launcher.live_comparison.run_finished, launcher.recording.choices.changed):
        changed.connect(kept.write)
    _begin(launcher, settings, options, arguments)
    store_changes(launcher, settings)
    if not options.config and not _last_configuration(settings):
        window.new.offer()
    code = app.exec_()
    _remember(keeper, launcher, settings)
    launcher.close()
    if watcher is not None:
        watcher.close()
    signals.close()
    if window.restarts:
        os.execv(sys.executable, [sys.executable, *words_to_go_on(
            launcher.session, launcher.viewers, sys.argv)])
    return int(code)


def _watch(app: QApplication, owner: CellOwner) -> int:
    """Report that another launcher has the cell; a window here would only hide the other one's."""
    second = SecondLauncher(owner)
    signals = StopSignals(app)
    signals.received.connect(second.close)
    app.setQuitOnLastWindowClosed(False)  # while RViz is shown
    second.ended.connect(app.quit)
    code = app.exec_()
    signals.close()
    if second.restarts:
        os.execv(sys.executable, [sys.executable, *sys.argv])
    return int(code)


def words_to_go_on(session: Session, viewers: Viewers, words: Sequence[str]) -> List[str]:
    """Return the command line of a program that continues where this one ends.

    Other computers may watch as before. The recording, and the values of the configuration's
    arguments, are in the settings. Values on the present command line no longer count.
    """
    ticked = ','.join(device.name for device in session.chosen)
    return [words[0], '--mode', session.mode.value, '--devices', ticked,
            *viewers.options(),
            *(word for word in words[1:] if word.startswith('__'))]  # roslaunch's own


class StopSignals(QObject):
    """SIGINT, SIGTERM and SIGHUP as a signal of Qt, whose loop otherwise does not notice them.

    SIGHUP is left out if nohup asks to ignore it.
    """

    received = pyqtSignal()

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._inside, self._outside = socket.socketpair()
        self._outside.setblocking(False)
        self._inside.setblocking(False)
        self._notifier = QSocketNotifier(self._inside.fileno(), QSocketNotifier.Read, self)
        self._notifier.activated.connect(self._take)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            if number is not signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, lambda *_: None)  # Python writes it to the wake-up socket
        signal.set_wakeup_fd(self._outside.fileno())

    def close(self) -> None:
        """Stop listening; from now on the signals are ignored, as the program ends anyway."""
        signal.set_wakeup_fd(-1)
        self._notifier.setEnabled(False)
        self._inside.close()
        self._outside.close()

    def _take(self) -> None:
        self._inside.recv(64)
        self.received.emit()


def _options(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog='gui', description=__doc__)
    parser.add_argument('config', nargs='?', default='',
                        help='the configuration (default: the last one, at first devices.xml)')
    parser.add_argument('--mode', choices=['', *(mode.value for mode in Mode)], default='')
    parser.add_argument('--bag', default='', help='a recording to play back')
    parser.add_argument('--devices', metavar='A,B', default='', help='tick only these')
    parser.add_argument('--remote', nargs='?', const='true', default='',
                        choices=['', 'true', 'false'],
                        help='other computers may watch what is launched, with "cell view"')
    parser.add_argument('--ports', metavar='FIRST-LAST', default='',
                        help='of which "cell view" uses one (default: '
                             f'{DEFAULT_PORTS[0]}-{DEFAULT_PORTS[-1]})')
    parser.add_argument('--launch', action='store_true', help='launch at once')
    options = parser.parse_args(words)
    if options.ports:
        try:
            ports_of(options.ports)
        except ValueError as error:
            parser.error(str(error))
    options.mode = options.mode or (Mode.PLAYBACK.value if options.bag else '')
    return options


def make_application() -> QApplication:
    """Return the application with the style of the launcher."""
    QApplication.setAttribute(Qt.AA_EnableHighDpiScaling)
    is_set = _NO_SHARED_PICTURE in os.environ
    os.environ.setdefault(_NO_SHARED_PICTURE, '1')
    app = QApplication(sys.argv[:1])
    if not is_set:
        del os.environ[_NO_SHARED_PICTURE]  # not for RViz, whose pictures are larger
    app.setApplicationName('process_visualizer')
    DesktopTheme(app.palette(), parent=app)  # before our own palette is set
    apply_style(app)
    return app


def _begin(launcher: Launcher, settings: Settings, options: argparse.Namespace,
           arguments: Dict[str, str]) -> None:
    """Connect, and open the requested configuration or the last one."""
    launcher.viewers = Viewers(options.remote == 'true', options.ports)
    launcher.begin()
    launcher.recording.choices.restore(settings.value('recording', {}))
    launcher.bag.restore(settings.value('bag', {}))
    launcher.bag.curves.choices.restore(settings.value('curves', {}))
    launcher.live.set_duration(settings.value('live_duration_s'))
    if options.bag:
        launcher.bag.open([options.bag])
    launcher.session.set_mode(Mode(options.mode or settings.value('mode', Mode.REALTIME.value)))
    launcher.cell.open(*_configuration(settings, options.config, arguments))
    if options.devices or options.launch:
        launcher.when_ready(options.devices.split(',') if options.devices else None,
                            options.launch)


def _configuration(settings: Settings, given: str,
                   arguments: Dict[str, str]) -> Tuple[str, Dict[str, str]]:
    if given:
        return given, arguments
    last = _last_configuration(settings)
    if last:
        return last['path'], {**last.get('arguments', {}), **arguments}
    package: str = rospkg.RosPack().get_path('process_visualizer')
    return os.path.join(package, 'devices.xml'), arguments


def _last_configuration(settings: Settings) -> Dict[str, Any]:
    """Return the last configuration; an empty one if its file no longer exists."""
    last: Dict[str, Any] = settings.value('configuration', {})
    return last if os.path.isfile(last.get('path', '')) else {}


def _remember(keeper: WindowKeeper, launcher: Launcher, settings: Settings) -> None:
    keeper.remember()
    _store(launcher, settings)


def store_changes(launcher: Launcher, settings: Settings) -> None:
    """Store what the operator chose when it changes: the program may be killed."""
    for changed in (launcher.cell.changed, launcher.bag.chosen, launcher.recording.choices.changed,
                    launcher.bag.curves.choices.changed):
        changed.connect(lambda: _store(launcher, settings))


def _store(launcher: Launcher, settings: Settings) -> None:
    settings.store('mode', launcher.session.mode.value)
    settings.store('configuration', launcher.cell.source)
    settings.store('recording', launcher.recording.choices.settings())
    settings.store('bag', launcher.bag.settings())
    settings.store('curves', launcher.bag.curves.choices.settings())
    settings.store('live_duration_s', launcher.live.duration_s)
    settings.sync()  # this process may be replaced at once


_MAX_ERRORS = 20
_ICON_PX = 28


class CaughtError(NamedTuple):
    """An error: its summary, its traceback, and where it was raised (file:line)."""

    summary: str
    traceback: str
    place: str


class ErrorDialog(TextDialog):
    """Lists each error once, with its count; the program keeps running."""

    def __init__(self, log_file: str, parent: Optional[QWidget] = None) -> None:
        super().__init__('error', 'Process Visualizer: an error', parent)
        self._log_file = log_file
        self._errors: Dict[CaughtError, int] = {}
        picture = plain_label()
        picture.setPixmap(icon('warning').pixmap(QSize(_ICON_PX, _ICON_PX)))
        self.row.insertWidget(0, picture, 0, Qt.AlignTop)
        self.finished.connect(lambda _: self._errors.clear())  # the operator has seen them

    def add(self, error: CaughtError) -> None:
        """Show an error, or count it if it is listed already."""
        known = next((it for it in self._errors
                      if (it.place, it.summary) == (error.place, error.summary)), error)
        if known in self._errors or len(self._errors) < _MAX_ERRORS:
            self._errors[known] = self._errors.get(known, 0) + 1
        self._refresh()
        if not self.isVisible():
            show_aside(self)

    def _refresh(self) -> None:
        total = sum(self._errors.values())
        number = 'An error has' if total == 1 else f'{total} errors have'
        where = f' Details are also in <i>{html.escape(self._log_file)}</i>.' \
            if self._log_file else ''
        self.show_text(
            f'<b>{number} occurred in the launcher itself.</b> The program continues; nodes and '
            f'recordings are not affected. Please send this to the maintainer.{where}',
            '\n\n'.join(f'{count}×  {error.summary}\n\n{error.traceback.rstrip()}'
                        for error, count in self._errors.items()))


_LOG_BYTES = 1 << 20
_FORMAT = '%(asctime)s %(threadName)s %(message)s'


class UncaughtErrors(QObject):
    """Accepts errors from any thread; reports them in the GUI thread."""

    caught = pyqtSignal(object)
    """A CaughtError."""

    def __init__(self, log_file: str = '', parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._logger = logging.Logger('process_visualizer.launcher')
        self.log_file = log_file if self._log_into(log_file) else ''

    def install(self) -> None:
        """Become the hook of this process for uncaught exceptions (sys and threading)."""
        sys.excepthook = self.take
        threading.excepthook = self._take_from_thread

    def take(self, kind: Type[BaseException], error: BaseException,
             trace: Optional[TracebackType]) -> None:
        """Log and report an error; Ctrl-C and exits are handled as usual."""
        if not issubclass(kind, Exception):
            sys.__excepthook__(kind, error, trace)
            return
        text = ''.join(traceback.format_exception(kind, error, trace))
        sys.stderr.write(text)
        self._logger.error('%s', text)
        summary = ''.join(traceback.format_exception_only(kind, error)).strip()
        self.caught.emit(CaughtError(summary, text, _place(trace)))

    def _take_from_thread(self, arguments: threading.ExceptHookArgs) -> None:
        if arguments.exc_type is not SystemExit and arguments.exc_value is not None:
            self.take(arguments.exc_type, arguments.exc_value, arguments.exc_traceback)

    def _log_into(self, file: str) -> bool:
        if not file:
            return False
        try:
            os.makedirs(os.path.dirname(file), exist_ok=True)
            handler = RotatingFileHandler(file, maxBytes=_LOG_BYTES, backupCount=1,
                                          encoding='utf-8')
        except OSError as error:
            sys.stderr.write(f'errors are not logged: {error}\n')
            return False
        handler.setFormatter(logging.Formatter(_FORMAT))
        self._logger.addHandler(handler)
        return True


def install_hooks(window: QWidget) -> UncaughtErrors:
    """Log uncaught errors into the launcher's log file and show them in a dialog of the window."""
    log_file = os.path.join(rospkg.get_ros_home(), 'process_visualizer', 'launcher.log')
    errors = UncaughtErrors(log_file, window)
    dialog = ErrorDialog(errors.log_file, window)
    errors.caught.connect(dialog.add, Qt.QueuedConnection)
    errors.install()
    return errors


def _place(trace: Optional[TracebackType]) -> str:
    """Return file:line where an error was raised."""
    frames = traceback.extract_tb(trace, limit=-1)
    return f'{frames[0].filename}:{frames[0].lineno}' if frames else ''
