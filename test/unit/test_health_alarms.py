# SPDX-License-Identifier: BSD-3-Clause
"""The alarms of a cell and its events, and times of a recording beyond the limits."""
from __future__ import annotations

from typing import Any, List

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType, Mode, Variable, WarningLimits
from process_visualizer.curves.curves import Curve, recorded_alarms
from process_visualizer.generate.plan import BAG_PART, FRAMES_PART, RVIZ_PART
from process_visualizer.health.alarm_board import Action, AlarmBoard, Condition
from process_visualizer.health.alarm_conditions import (
    conflict_conditions,
    limit_conditions,
    loss_conditions,
    message_conditions,
    own_part_conditions,
    part_conditions,
    recorded_conditions,
    topic_conditions,
    watch_conditions,
)
from process_visualizer.health.device_state import Level, Line
from process_visualizer.health.node_warnings import NodeWarning, NodeWarnings, Severity
from process_visualizer.launching.cell_watch import MASTER_OTHER, MASTER_SILENT, CellLook
from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport, PartState
from process_visualizer.ros_names import CONFLICT_KEY, EXCESS_KEY, LIMIT_KEY

HERE = Location('cell.xml', 1)
SILENT = Condition('arm', '/arm/q', 'No data from /arm/q', Level.WARNING,
                   end='data resumed')
BEYOND = Condition('oven', 'limit', 'oven is above 200', Level.BAD)


def texts(board: AlarmBoard) -> List[str]:
    return [event.text for event in board.events]


# The board

def test_an_alarm_begins_and_ends() -> None:
    board = AlarmBoard().seen([SILENT], 10.0).seen([SILENT], 11.0).seen([], 12.5)
    assert board.alarms == ()
    assert [tuple(event) for event in board.events] == [
        (10.0, 'arm: No data from /arm/q'),
        (12.5, 'arm: No data from /arm/q: data resumed after 2.5 s')]


def test_the_worst_comes_first_then_the_oldest() -> None:
    board = AlarmBoard().seen([SILENT], 1.0)
    board = board.seen([SILENT, SILENT._replace(about='/arm/tcf'), BEYOND], 2.0)
    assert [(it.condition.about, it.since_s) for it in board.alarms] == [
        ('limit', 2.0), ('/arm/q', 1.0), ('/arm/tcf', 2.0)]


def test_of_the_same_alarm_twice_the_worse_one_counts() -> None:
    mild = BEYOND._replace(text='oven is above 180', level=Level.WARNING)
    for conditions in ([BEYOND, mild], [mild, BEYOND]):
        board = AlarmBoard().seen(conditions, 1.0)
        assert [it.condition.level for it in board.alarms] == [Level.BAD]
        assert texts(board) == ['oven is above 200']


def test_a_text_that_changes_is_the_same_alarm() -> None:
    board = AlarmBoard().seen([BEYOND], 1.0).seen([BEYOND._replace(text='up to 230')], 2.0)
    assert (len(board.events), board.alarms[0].since_s, board.alarms[0].condition.text) == (
        1, 1.0, 'up to 230')
    assert texts(board.seen([], 3.0))[-1] == 'oven: up to 230: over after 2.0 s'


def test_since_when_as_the_node_says() -> None:
    assert AlarmBoard().seen([BEYOND._replace(since_s=3.0)], 4.0).alarms[0].since_s == 3.0


def test_a_time_that_is_told_a_little_differently_changes_nothing() -> None:
    board = AlarmBoard().seen([BEYOND._replace(since_s=3.0)], 4.0)
    assert board.seen([BEYOND._replace(since_s=3.0001)], 5.0) == board


def test_alarms_of_a_recording_are_no_events() -> None:
    board = AlarmBoard().seen([BEYOND._replace(position_s=7.0)], 1.0)
    assert (len(board.alarms), board.seen([], 2.0).events) == (1, ())


def test_notes_are_events_too() -> None:
    board = AlarmBoard().noted('launched', 1.0).noted('mark seam', 5.0)
    assert [event.text for event in board.events_since(2.0)] == ['mark seam']


LATCHED = BEYOND._replace(is_latched=True)


def test_a_latched_alarm_stays_until_it_is_acknowledged() -> None:
    board = AlarmBoard().seen([LATCHED], 1.0).seen([], 3.0).seen([], 9.0)
    (alarm,) = board.alarms
    assert (alarm.since_s, alarm.ended_s) == (1.0, 3.0)
    board = board.acknowledged(LATCHED, 'anna', 10.0)
    assert board.alarms == ()
    assert [tuple(event) for event in board.events] == [
        (1.0, 'oven is above 200'), (3.0, 'oven is above 200: over after 2.0 s'),
        (10.0, 'oven is above 200: acknowledged by anna')]
    assert board.acknowledged(LATCHED, 'anna', 11.0) == board


def test_what_is_acknowledged_while_it_lasts_goes_when_it_is_over() -> None:
    board = AlarmBoard().seen([LATCHED], 1.0).acknowledged(LATCHED, 'anna', 2.0)
    assert board.alarms[0].is_acknowledged
    board = board.seen([LATCHED], 3.0)
    assert board.alarms[0].is_acknowledged
    assert board.seen([], 4.0).alarms == ()


def test_what_begins_again_is_the_same_alarm() -> None:
    board = AlarmBoard().seen([LATCHED], 1.0).seen([], 2.0).seen([LATCHED], 5.0)
    assert [(it.since_s, it.ended_s) for it in board.alarms] == [(5.0, None)]
    assert texts(board) == ['oven is above 200', 'oven is above 200: over after 1.0 s',
                            'oven is above 200']


def test_how_often_it_came_and_since_when_is_known_until_it_is_acknowledged() -> None:
    board = AlarmBoard()
    for begin_s in (1.0, 5.0, 9.0):
        board = board.seen([LATCHED], begin_s).seen([], begin_s + 2.0)
    (alarm,) = board.alarms
    assert (alarm.times, alarm.first_s, alarm.since_s, alarm.ended_s) == (3, 1.0, 9.0, 11.0)
    (alarm,) = board.acknowledged(LATCHED, 'anna', 12.0).seen([LATCHED], 13.0).alarms
    assert (alarm.times, alarm.first_s) == (1, None)


def test_an_alarm_that_ended_and_came_again_between_two_looks_is_counted() -> None:
    board = AlarmBoard().seen([LATCHED._replace(times=1, since_s=1.0)], 1.0)
    board = board.seen([LATCHED._replace(times=2, since_s=4.0)], 4.3)
    board = board.seen([LATCHED._replace(times=5, since_s=8.0)], 8.5)
    (alarm,) = board.alarms
    assert (alarm.times, alarm.first_s, alarm.since_s) == (5, 1.0, 8.0)
    assert [tuple(event) for event in board.events] == [
        (1.0, 'oven is above 200'),
        (4.0, 'oven is above 200: over'), (4.0, 'oven is above 200'),
        (8.0, 'oven is above 200: over, and 2 more of it since'), (8.0, 'oven is above 200')]
    board = board.acknowledged(LATCHED, 'anna', 12.0)
    assert texts(board)[-1] == 'oven is above 200 (5×): acknowledged by anna'
    assert board.seen([LATCHED._replace(times=5, since_s=8.0)], 13.0).events == board.events


def test_an_event_is_as_old_as_what_began_again() -> None:
    board = AlarmBoard().seen([LATCHED], 1.0).seen([], 2.0)
    assert board.seen([LATCHED._replace(since_s=5.0)], 7.0).events[-1].time_s == 5.0


def test_what_is_wrong_now_comes_before_what_was_wrong_in_the_recording() -> None:
    board = AlarmBoard().seen([SILENT], 1.0).seen([SILENT, BEYOND._replace(position_s=7.0)], 2.0)
    assert [it.condition.source for it in board.alarms] == ['arm', 'oven']


def test_what_lasts_comes_before_what_is_over() -> None:
    board = AlarmBoard().seen([LATCHED], 1.0).seen([SILENT], 2.0)
    assert [it.condition.source for it in board.alarms] == ['arm', 'oven']


@given(st.lists(st.sets(st.sampled_from('abcd')), max_size=20))
def test_every_begin_has_its_end(steps: Any) -> None:
    board = AlarmBoard()
    for now_s, names in enumerate(steps):
        board = board.seen([SILENT._replace(about=name, text=name) for name in names], now_s)
        assert {alarm.condition.about for alarm in board.alarms} == names
    board = board.seen([], 99.0)
    for name in 'abcd':
        about = [text for text in texts(board) if text.startswith(f'arm: {name}')]
        assert all(('after' in text) == bool(row % 2) for row, text in enumerate(about))
        assert len(about) % 2 == 0


# Problems

def test_a_dead_node() -> None:
    report = PartReport('arm', PartState.RUNNING, (
        NodeReport('/arm/driver', NodeState.EXITED, -9), NodeReport('/arm/robot_proc',
                                                                    NodeState.RUNNING)))
    (found,) = part_conditions('arm', report, Action.RESTART_DEVICE)
    assert found.text == 'driver killed by SIGKILL'
    assert (found.level, found.node) == (Level.BAD, '/arm/driver')
    assert found.actions == (Action.RESTART_DEVICE, Action.SHOW_LOG)


def test_a_node_that_is_called_like_its_device_is_not_said_twice() -> None:
    report = PartReport('arm', PartState.RUNNING, (
        NodeReport('/arm/arm', NodeState.EXITED, -9),))
    (found,) = part_conditions('arm', report, Action.RESTART_DEVICE)
    assert found.text == 'killed by SIGKILL'


def test_nodes_that_are_being_stopped_are_no_alarm() -> None:
    dead = NodeReport('/rviz', NodeState.EXITED, 1)
    assert part_conditions('RViz', PartReport('rviz', PartState.STOPPING, (dead,)),
                           Action.RESTART_RVIZ) == []


def own(part: str, *reports: PartReport, mode: Mode = Mode.PLAYBACK) -> List[Condition]:
    return [it for report in reports for it in own_part_conditions(mode, {part: report})]


def test_a_window_that_was_closed_is_missed_until_it_is_restarted() -> None:
    """Its roslaunch ends some seconds later: the part is then stopped."""
    closed = PartReport(RVIZ_PART, PartState.RUNNING, (
        NodeReport('/rviz', NodeState.EXITED, 0),))
    for found in own(RVIZ_PART, closed, closed.ended(0)):
        assert (found.said, found.level) == ('RViz was closed', Level.WARNING)
        assert Action.RESTART_RVIZ in found.actions
    assert closed.ended(0).state is PartState.STOPPED
    assert own(RVIZ_PART, closed.ended(0).stopping().stopped()) == []


def test_a_window_that_was_killed() -> None:
    (found,) = own(RVIZ_PART, PartReport(RVIZ_PART, PartState.RUNNING, (
        NodeReport('/rviz', NodeState.EXITED, -9),)))
    assert (found.said, found.level) == ('RViz was killed', Level.BAD)


def test_a_player_says_why_it_stopped() -> None:
    def ended(*lines: str) -> PartReport:
        return PartReport(BAG_PART, PartState.RUNNING, (
            NodeReport('/bag_player', NodeState.EXITED, 1, log_tail=lines),))

    reason = 'bag_player: foreign.bag has none of these topics'
    assert [it.said for it in own(BAG_PART, ended('reading', reason), ended())] == [
        'Player stopped: foreign.bag has none of these topics',
        'Player stopped (ended with code 1)']
    (found,) = own(BAG_PART, PartReport(BAG_PART, PartState.RUNNING, (
        NodeReport('/bag_recorder', NodeState.EXITED, -9),)), mode=Mode.REALTIME)
    assert found.said == 'Recorder was killed'


def test_a_part_that_has_failed() -> None:
    (found,) = part_conditions('arm', PartReport('arm', PartState.FAILED, reason='no memory'),
                               Action.RESTART_DEVICE)
    assert (found.text, found.part) == ('no memory', 'arm')


def test_silent_topics() -> None:
    lines = {'/q': Line(Level.WARNING, 'no data for 2.2 s', for_s=2.5),
             '/f': Line(Level.GOOD, '90 Hz'), '/n': Line(Level.WAITING, 'no message yet')}
    found, = topic_conditions('arm', lines, 100.0)
    assert (found.text, found.since_s) == ('No data from /q', 97.5)


def test_variables_beyond_their_limits() -> None:
    warning = NodeWarning('/oven/variable_proc', Severity.ERROR, 'oven is above 200 °C', 0, 5.0,
                          9.0, {LIMIT_KEY: 'up to 230 °C', EXCESS_KEY: '30.0'})
    other = NodeWarning('/oven/variable_proc', Severity.WARNING, 'wrong type', 3, 5.0, 9.0)
    (found,) = limit_conditions('oven', [warning, other], 1000.0)
    assert (found.text, found.since_s) == ('oven is above 200 °C, up to 230 °C', 1005.0)
    assert found.is_latched and found.actions == (Action.REPLAY, Action.ACKNOWLEDGE)


def test_losses_only_while_recording() -> None:
    assert loss_conditions(True, 0, 0) == loss_conditions(False, 3, 0) == []
    assert [it.text for it in loss_conditions(True, 3, 2)] == [
        'messages are missing: 3 dropped, 2 lost']


def test_messages_that_are_missing_are_so_for_ever() -> None:
    board = AlarmBoard().seen(loss_conditions(True, 3, 0), 1.0)
    board = board.seen(loss_conditions(True, 3, 2), 2.0).seen(loss_conditions(False, 3, 2), 5.0)
    assert texts(board) == [
        'recording: messages are missing: 3 dropped',
        'recording: messages are missing: 3 dropped, 2 lost: not recovered before the recording '
        'ended, after 4.0 s']


# A recording

def oven(**limits: Any) -> Device:
    variable = Variable('/heat', 'data', 'oven', (1.0, 0.0, 0.0), (1.0, 0.0, 0.0), '°C', 1.0, 0.0,
                        'heat', HERE, limits=WarningLimits(
                            limits.get('low'), limits.get('high'), (1.0, 0.0, 0.0)))
    return Device(DeviceType.OTHER, 'oven', HERE, variables=(variable,))


def curve(low: Any, high: Any) -> Curve:
    times_s = (np.arange(len(low)) + 0.5) * 0.1
    return Curve('oven', 'heat', '°C', (1.0, 0.0, 0.0), '/heat', times_s, np.array(low),
                 np.array(high))


def test_alarms_of_a_recording() -> None:
    low = [20.0] * 10 + [20.0] * 5 + [np.nan] * 5 + [20.0] * 10
    high = [25.0] * 10 + [230.0] * 5 + [np.nan] * 5 + [25.0] * 10
    (found,) = recorded_alarms([oven(low=0.0, high=200.0)], [curve(low, high)])
    assert found[:2] == ('oven', 'heat is above 200 °C, up to 230 °C')
    assert (round(found.begin_s, 6), round(found.end_s, 6)) == (1.05, 2.05)
    at = [position_s for position_s in np.arange(0.0, 3.0, 0.1)
          if recorded_conditions([found], position_s)]
    assert (round(at[0], 6), round(at[-1], 6)) == (1.1, 2.0)
    (condition,) = recorded_conditions([found], 1.5)
    assert (condition.position_s, condition.actions) == (found.begin_s, (Action.GO_THERE,))


def test_without_limits_or_curves_there_are_no_alarms() -> None:
    assert recorded_alarms([oven()], [curve([0.0], [1e9])]) == ()
    assert recorded_alarms([oven(high=1.0)], []) == ()


# Silent nodes, and conflicting publishers

def test_who_does_not_answer_is_told_by_its_name_with_what_helps() -> None:
    parts = {'/arm/robot_proc': 'arm', '/bag_recorder': BAG_PART, '/cell_frames': FRAMES_PART,
             '/oven': 'oven', '/rviz': RVIZ_PART}
    found = watch_conditions(Mode.REALTIME, CellLook(frozenset(parts)), parts)
    assert [(it.said, it.actions[0], it.part) for it in found] == [
        ('arm: robot_proc is not responding', Action.RESTART_DEVICE, 'arm'),
        ('Recorder is not responding', Action.RESTART_PART, BAG_PART),
        ('Frames: cell_frames is not responding', Action.RESTART_PART, FRAMES_PART),
        ('oven is not responding', Action.RESTART_DEVICE, 'oven'),
        ('RViz is not responding', Action.RESTART_RVIZ, RVIZ_PART)]


def test_what_the_nodes_say_themselves_is_not_said_twice() -> None:
    told = Condition('arm', '/arm/robot_proc', 'robot_proc is not responding: no arrows',
                     Level.BAD, node='/arm/robot_proc')
    look = CellLook(frozenset({'/arm/robot_proc'}))
    assert watch_conditions(Mode.REALTIME, look, {}, [told]) == []
    [alone] = watch_conditions(Mode.REALTIME, look, {'/arm/robot_proc': 'arm'})
    assert (alone.source, alone.about) == (told.source, told.about)  # one alarm from either source


def test_a_master_that_does_not_answer_is_an_alarm() -> None:
    [found] = watch_conditions(Mode.PLAYBACK, CellLook(master_problem=MASTER_SILENT), {})
    assert found.level is Level.BAD and found.said.startswith('ROS master is not responding; ')


def test_a_master_that_comes_back_as_another_one_is_another_event() -> None:
    board = AlarmBoard()
    for time_s, problem in enumerate((MASTER_SILENT, MASTER_OTHER)):
        look = CellLook(master_problem=problem)
        board = board.seen(watch_conditions(Mode.REALTIME, look, {}), time_s)
    assert texts(board)[1] == f'ROS master {MASTER_OTHER}'


def test_nodes_that_contradict_each_other_are_an_alarm() -> None:
    warnings = [NodeWarning('/arm/joint_proc', Severity.WARNING, 'long', 3, 0.0, 1.0,
                            {CONFLICT_KEY: '/arm/q: 2 nodes'}),
                NodeWarning('/arm/robot_proc', Severity.WARNING, 'other', 0, 0.0, 1.0)]
    assert [it.said for it in conflict_conditions('arm', warnings)] == ['arm: /arm/q: 2 nodes']


def test_messages_that_are_left_out_for_some_time_are_an_alarm() -> None:
    text = 'a message on /arm/tcf is left out: it carries std_msgs/String'
    left_out = NodeWarning('/arm/robot_proc', Severity.WARNING, text, 5, 10.0, 12.0,
                           {'messages': '5', 'for_s': '2.0'})
    line = NodeWarning('/arm/driver', Severity.WARNING, 'slow', 5, 10.0, 12.0)  # from a log
    frame = NodeWarning('/arm/robot_proc', Severity.WARNING, 'no frame x', 0, 10.0, 12.0,
                        {'messages': '0', 'for_s': '2.0'})
    for now_s, found in ((10.5, []), (12.0, [f'arm: {text}'])):
        conditions = message_conditions('arm', [left_out, line, frame], now_s)
        assert [it.said for it in conditions] == found


def test_a_message_problem_whose_words_count_seconds_is_one_alarm() -> None:
    said = NodeWarnings()
    board = AlarmBoard()
    for second in range(1, 5):
        said.take_state('/arm/joint_proc', '/arm/joint_proc: /arm/q', Severity.WARNING,
                        f'a message on /arm/q is shown, but none of joint 1 has come for {second} '
                        's', float(second), {'messages': '5', 'for_s': str(second + 1)})
        board = board.seen(message_conditions('arm', said.present(second), second), second)
    assert len(board.events) == 1
    assert board.alarms[0].condition.text.endswith('for 4 s')


def test_what_two_nodes_say_in_the_same_words_is_one_alarm() -> None:
    said = [NodeWarning(node, Severity.WARNING, 'a message on /arm/q is left out', 5, 0.0, 2.0,
                        {'for_s': '2.0'}, f'{node}: /arm/q')
            for node in ('/arm/joint_proc', '/arm/robot_proc')]
    assert len(message_conditions('arm', said, 2.0)) == 1
