# SPDX-License-Identifier: BSD-3-Clause
"""The command ``bag_player``: plays recordings in a terminal or as a node of a launch file."""
from __future__ import annotations

import contextlib
import os
import sys
import time
from typing import Callable, List, Optional, Sequence, Type

import rosgraph
import rospy

from process_visualizer.bagio.bag_errors import BagError, BagUnindexed
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.reindex import ReindexCanceled, copy_path, reindex
from process_visualizer.launching.ros_api import (
    PATIENT_TIMEOUT_S,
    MasterClient,
    MasterUnreachable,
)
from process_visualizer.nodes.common.node_handle import start_node
from process_visualizer.playback.timeline import CommandRefused
from process_visualizer.playback.topic_choice import TopicChoice
from process_visualizer.player.bag_player import (
    BagPlayer,
    NothingToPlay,
    PlaybackFailed,
    PlayerSettings,
)
from process_visualizer.player.player_options import (
    PlayerOptions,
    parse_options,
    topic_remaps,
    without_topic_remaps,
)
from process_visualizer.player.player_terminal import PlayerTerminal
from process_visualizer.player.timed_sender import take_long_slices
from process_visualizer.ros_names import BAG_PLAYER
from process_visualizer.shown_text import say

_PERIOD_S = 0.2


class ReindexRefused(Exception):
    """The user refused to copy a bag without an index, or canceled the copy."""


def reindexed(path: str, reason: str, allowed: bool) -> str:
    """Return the path of an indexed copy of a bag; the bag itself is only read.

    An existing copy newer than the bag is used as it is.

    Raises:
        ReindexRefused: the user does not want a copy.
        BagError: the bag holds nothing that can be copied, or the copy cannot be written.
    """
    copy = copy_path(path)
    if os.path.exists(copy) and os.path.getmtime(copy) >= os.path.getmtime(path):
        say(f'{reason}: playing {copy}', file=sys.stderr)
        return copy
    if not allowed and not _agreed(reason, copy):
        raise ReindexRefused(f'{reason}; bag_player --reindex {path} makes {copy} and plays it')
    try:
        result = reindex(path, _Progress(copy).show)
    except (ReindexCanceled, KeyboardInterrupt):
        raise ReindexRefused(f'{path}: the copy was canceled') from None
    say(f'{result.path}: {result.message_count} messages', file=sys.stderr)
    for gap in result.gaps:
        say(gap, file=sys.stderr)
    return result.path


def _agreed(reason: str, copy: str) -> bool:
    if not sys.stdin.isatty():
        return False
    say(f'{reason}.\nWrite an indexed copy to {copy} and play that? [Y/n] ', end='',
        file=sys.stderr)
    return sys.stdin.readline().strip().lower() in ('', 'y', 'yes')


class _Progress:
    """A progress line, rewritten periodically."""

    def __init__(self, copy: str) -> None:
        self._copy = copy
        self._next_s = 0.0

    def show(self, part: float) -> bool:
        """Show the finished share (0 to 1); return True: copying continues."""
        now_s = time.monotonic()
        if now_s >= self._next_s or part >= 1.0:
            self._next_s = now_s + _PERIOD_S
            end = '\n' if part >= 1.0 else '\r'
            say(f'{self._copy}: {100 * part:3.0f} %  (Ctrl-C cancels)', end=end,
                file=sys.stderr)
        return True


PRIORITY = -10
"""Priority of all threads: other busy programs must not delay sending (see nice(1))."""
NOT_ALL = 3
"""Exit code if a part of the recording could not be played."""
INTERRUPTED = 130
"""Exit code that shells use for Ctrl-C."""
SWITCH_INTERVAL_S = 0.0005  # maximum time a thread computes while another has a message to send


def main(arguments: Optional[Sequence[str]] = None,
         recording_type: Type[Recording] = Recording) -> int:
    """Run the command; return its exit code."""
    words = list(sys.argv if arguments is None else arguments)
    options = parse_options(rospy.myargv(words)[1:])
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    take_priority()
    return exit_code(lambda: _play(options, words, recording_type))


_MASTER_LOST = (MasterUnreachable, ConnectionRefusedError)  # the latter if rospy calls the master


def exit_code(play: Callable[[], int]) -> int:
    """Play; print errors, and return the exit code."""
    try:
        return play()
    except (BagError, NothingToPlay, PlaybackFailed, ReindexRefused, CommandRefused,
            ValueError) as error:
        say(f'bag_player: {error}', file=sys.stderr)
    except KeyboardInterrupt:  # before the node starts; rospy handles later ones
        return INTERRUPTED
    except (rospy.ROSException, rosgraph.MasterException, OSError) as error:
        if rospy.is_shutdown():  # by a signal during startup
            return 0
        is_of_master = not isinstance(error, OSError) or isinstance(error, _MASTER_LOST)
        say(f'bag_player: the ROS master cannot be used: {error}; is roscore running?'
            if is_of_master else f'bag_player: {error}', file=sys.stderr)
    return 1


def take_priority() -> None:
    """Raise the priority above busy programs, if the user may do so and chose no other one."""
    if os.getpriority(os.PRIO_PROCESS, 0) == 0:
        with contextlib.suppress(PermissionError):  # without it, messages may be less punctual
            os.setpriority(os.PRIO_PROCESS, 0, PRIORITY)


def _play(options: PlayerOptions, words: List[str], recording_type: Type[Recording]) -> int:
    take_long_slices()
    with opened(options, recording_type) as recording:
        # rospy would wait forever for a master.
        MasterClient(f'/{BAG_PLAYER}', timeout_s=PATIENT_TIMEOUT_S).getPid()
        start_node(BAG_PLAYER, without_topic_remaps(words))
        choice = TopicChoice(options.topics, options.exclude, options.prefix,
                             topic_remaps(words, rospy.get_namespace()))
        topics = [it.topic for it in recording.index.connections]
        for named in (choice, TopicChoice(options.pause_topics)):
            for message in named.unmatched_messages(topics):
                rospy.logwarn(message)
        player = BagPlayer(recording, _settings(options, choice))
        try:
            _run(player, options)
        finally:
            player.close()
        _sum_up(player)
    return 0 if player.is_complete else NOT_ALL


def opened(options: PlayerOptions, recording_type: Type[Recording] = Recording) -> Recording:
    """Return the recording; a bag without an index is replaced by an indexed copy, if allowed.

    Raises:
        BagError: a file cannot be played.
        ReindexRefused: a bag has no index, and no copy may be made.
    """
    paths = list(options.files)
    while True:
        try:
            return recording_type(paths)
        except BagUnindexed as error:
            paths = [reindexed(path, str(error), options.reindex) if path == error.file else path
                     for path in paths]


def _settings(options: PlayerOptions, choice: TopicChoice) -> PlayerSettings:
    start_s = options.start_s or 0.0
    end_s = None if options.duration_s is None else start_s + options.duration_s
    return PlayerSettings(choice, end_s, not options.recorded_stamps,
                          options.clock_hz if options.clock else None, options.queue_size,
                          options.pauses_beside_others, options.keep_alive,
                          options.skip_empty_s, options.pause_topics, options.rate_control_topic,
                          options.rate_control_max_delay_s)


def _run(player: BagPlayer, options: PlayerOptions) -> None:
    player.print_problems()
    player.prepare(options.rate, options.start_s, options.loop)
    if player.wait_for_subscribers(options.delay_s, options.wait_for_subscribers):
        player.start(options.paused)
        with PlayerTerminal(player.status, player.control, player.quit, options.quiet):
            player.wait()


def _sum_up(player: BagPlayer) -> None:
    lines = player.summary()
    if lines:
        say('\n  '.join(['bag_player: not everything was played or arrived:', *lines]),
            file=sys.stderr)
