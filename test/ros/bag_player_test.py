#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The player with a real master: what subscribers get, and what the services do."""
from __future__ import annotations

import struct
import unittest
from pathlib import Path
from typing import Dict, List, Tuple

import numpy as np
import rospy
import rostest
from player_testing import Listener, Player, Row, cell_rows, serialised, temporary_folder, write_bag
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Float32MultiArray, String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker

from process_visualizer.msg import PlayerState
from process_visualizer.srv import Seek, SetLoop, SetRate, Step
from process_visualizer.terminal.player_program import NOT_ALL

NAN = float('nan')
MOMENT_MS = 200  # what comes first so soon is there from the beginning
ALL = ('/text', '/tcf', '/image', '/info', '/tf', '/tf_static', '/marker')
STAMPED_AT: Dict[str, int] = {'/image': 4, '/info': 4, '/tf': 8, '/tf_static': 8, '/marker': 4}


def without_stamp(topic: str, data: bytes) -> Tuple[bytes, bytes]:
    """The bytes before and behind the stamp of a message."""
    at = STAMPED_AT.get(topic)
    return (data, b'') if at is None else (data[:at], data[at + 8:])


def stamp_s(topic: str, data: bytes) -> float:
    """The stamp in a message."""
    seconds, nanoseconds = struct.unpack_from('<II', data, STAMPED_AT[topic])
    return seconds + nanoseconds * 1e-9


def times(listener: Listener) -> List[float]:
    """The numbers in the messages on /tcf."""
    return [round(Float32MultiArray().deserialize(data).data[0], 4)
            for data in listener.of('/tcf')]


def falls(values: List[float]) -> List[int]:
    """Where a value is less than the one before it."""
    return [index for index in range(1, len(values)) if values[index] < values[index - 1]]


def frames_in(listener: Listener) -> List[str]:
    """The frames in the last message on /tf_static."""
    return [it.child_frame_id for data in listener.of('/tf_static')[-1:]
            for it in TFMessage().deserialize(data).transforms]


class BagPlayerTest(unittest.TestCase):
    """Plays a bag of one second, in which a number is the time."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = temporary_folder()
        cls.rows = cell_rows()
        cls.bag = write_bag(Path(cls.folder.name) / 'cell.bag', cls.rows)

    @classmethod
    def tearDownClass(cls) -> None:
        cls.folder.cleanup()

    def of(self, topic: str) -> List[Row]:
        """The recorded messages of a topic."""
        return [row for row in self.rows if row.topic == topic]

    def check_played(self, listener: Listener) -> None:
        """Every message came once, in order, with the bytes that were recorded but for stamps."""
        for topic in ALL:
            if topic == '/tf_static':
                continue  # merged where it comes with a scene
            recorded = [without_stamp(topic, serialised(row.message)) for row in self.of(topic)]
            self.assertEqual([without_stamp(topic, data) for data in listener.of(topic)
                              if topic != '/marker' or b'seam' in data], recorded, topic)

    def test_every_message_comes_once_and_in_order(self) -> None:
        for compression in ('none', 'bz2', 'lz4'):
            bag = write_bag(Path(self.folder.name) / f'{compression}.bag', self.rows,
                            compression=compression)
            with Listener(*ALL) as listener, \
                    Player(bag, '--wait-for-subscribers', '-q') as player:
                self.assertEqual(player.wait(), (0, ''))
                listener.wait_for(lambda: len(times(listener)) == 126, '/tcf')
                self.check_played(listener)

    def test_a_pause_before_play_begins_counts(self) -> None:
        for name in ('pause', 'stop'):
            with Player(self.bag, '-d', '3', '-k') as player:
                self.assertTrue(player.call(name, Trigger).success)
                with Listener('/text') as listener:  # latched: it comes when all has begun
                    listener.wait_for(lambda at=listener: at.received, 'the scene')
                    state = player.wait_for_state(lambda it: it.published > 0, 'the scene')
                self.assertTrue(state.paused)
                self.assertEqual(state.position, 0.0)

    def test_while_paused_the_scene_comes_again_for_what_has_started_meanwhile(self) -> None:
        with Listener('/tcf') as listener, Player(self.bag, '--pause', '-s', '0.4') as player:
            player.wait_for_state(lambda it: it.paused and it.published > 0, 'the scene')
            listener.wait_for(lambda: len(listener.received) > 0, 'the scene')
            listener.clear()
            listener.wait_for(lambda: len(listener.received) > 2, 'the scene again, and again')
            self.assertEqual(set(times(listener)), {0.4})

    def test_the_position_of_a_state_is_that_of_its_stamp(self) -> None:
        with Player(self.bag, '-d', '2', '-r', '0.25') as player:
            player.wait()
            states = [it for it in player.states if not it.paused and 0.0 < it.position < 1.0]
        first = states[len(states) // 2]  # a busy machine may slip; since then it runs evenly
        even = [it for it in states if abs((it.since - first.since).to_sec()) < 0.001]
        self.assertGreater(len(even), 5)
        for state in even:
            elapsed_s = (state.stamp - first.stamp).to_sec()
            self.assertAlmostEqual(state.position, first.position + 0.25 * elapsed_s, delta=1e-5)

    def test_split_bags_are_one_recording(self) -> None:
        half = len(self.rows) // 2
        parts = [write_bag(Path(self.folder.name) / f'part{number}.bag', rows)
                 for number, rows in enumerate((self.rows[half:], self.rows[:half]))]
        with Listener(*ALL) as listener, \
                Player(*parts, '--wait-for-subscribers', '-r', '4') as player:
            self.assertEqual(player.wait()[0], 0)
            listener.wait_for(lambda: len(times(listener)) == 126, '/tcf')
            self.check_played(listener)

    def test_stamps_are_of_the_present_and_equal_ones_stay_equal(self) -> None:
        with Listener('/image', '/info') as listener, Player(self.bag, '-d', '2') as player:
            player.wait()
            arrivals = {(it.topic, it.data): it.time_s for it in listener.received}
        for (topic, data), time_s in arrivals.items():
            self.assertLess(stamp_s(topic, data), time_s)
            self.assertGreater(stamp_s(topic, data), time_s - 0.5)
        images = [stamp_s('/image', data) for data in listener.of('/image')]
        infos = [stamp_s('/info', data) for data in listener.of('/info')]
        self.assertEqual(images, infos)
        steps = [later - earlier for earlier, later in zip(images, images[1:])]
        for step_s in steps[1:]:  # nothing is stamped before play began
            self.assertAlmostEqual(step_s, 0.04, delta=0.0005)

    def test_who_comes_late_gets_what_was_latched(self) -> None:
        with Player(self.bag, '-s', '0.55', '-r', '0.01') as player:
            player.wait_for_state(lambda it: not it.paused and it.position > 0.551, 'playing')
            with Listener('/text', '/tf_static') as listener:
                listener.wait_for(lambda: len(listener.received) == 2, 'latched messages')
                text = String().deserialize(listener.of('/text')[0])
                self.assertEqual(text.data, 'changed')
                self.assertEqual(listener.received[0].header['latching'], '1')
                static = TFMessage().deserialize(listener.of('/tf_static')[0])
                self.assertEqual([it.child_frame_id for it in static.transforms],
                                 ['fixed0', 'fixed1'])

    def test_who_comes_late_while_it_plays_gets_all_static_transforms(self) -> None:
        with Player(self.bag, '-s', '0.55', '-r', '0.1') as player:
            player.wait_for_state(lambda it: not it.paused and it.position > 0.61, 'playing')
            player.call('set_rate', SetRate, 0.01)
            with Listener('/tf_static') as listener:
                listener.wait_for(lambda: len(listener.received) > 0, 'static transforms')
                self.assertEqual(frames_in(listener), ['fixed0', 'fixed1', 'fixed2'])

    def test_who_comes_late_while_paused_sees_the_scene(self) -> None:
        with Player(self.bag, '--pause', '-s', '0.5') as player:
            player.wait_for_state(lambda it: it.position == 0.5, 'the position')
            with Listener('/image', '/tcf') as listener:
                listener.wait_for(lambda: bool(listener.of('/image') and times(listener)),
                                  'the scene')
                self.assertEqual(times(listener)[-1], 0.496)
                self.assertAlmostEqual(stamp_s('/image', listener.of('/image')[-1]),
                                       rospy.get_time(), delta=0.5)

    def test_a_seek_while_paused_publishes_the_scene(self) -> None:
        with Listener(*ALL) as listener, \
                Player(self.bag, '--pause', '--wait-for-subscribers') as player:
            listener.wait_for(lambda: bool(times(listener)), 'the beginning')
            for position_s in (0.7, 0.35, 0.9, 0.1):
                self.check_seek(player, listener, position_s)

    def check_seek(self, player: Player, listener: Listener, position_s: float) -> None:
        """Go to a position and compare what comes with the recording."""
        listener.clear()
        answer = player.call('seek', Seek, position_s)
        self.assertEqual((answer.success, answer.message), (True, f'at {position_s:.3f} s'))
        past = [row for row in self.rows if row.time_ms <= position_s * 1000]
        last = {row.topic: row.message for row in past if row.topic != '/tf_static'}
        listener.wait_for(lambda: all(
            [without_stamp(topic, data) for data in listener.of(topic)[-1:]]
            == [without_stamp(topic, serialised(message))] for topic, message in last.items()),
            'the scene')
        now_s = rospy.get_time()
        for topic in {'/image', '/info', '/tf'} & last.keys():
            self.assertAlmostEqual(stamp_s(topic, listener.of(topic)[-1]), now_s, delta=0.5)
        frames = [row.message.transforms[0].child_frame_id for row in self.of('/tf_static')
                  if row.time_ms <= max(position_s * 1000, MOMENT_MS)]
        listener.wait_for(lambda: frames_in(listener) == frames, 'the static transforms')
        listener.wait_for(lambda: bool(listener.of('/marker')), 'markers are removed')
        self.assertEqual(Marker().deserialize(listener.of('/marker')[0]).action, Marker.DELETEALL)

    def test_steps(self) -> None:
        with Listener('/tcf', '/image') as listener, Player(
                self.bag, '--pause', '--wait-for-subscribers', '--topics', '/tcf',
                '/image') as player:
            listener.wait_for(lambda: bool(times(listener)), 'the beginning')
            player.call('seek', Seek, 0.5)
            for arguments, shown_s in (((1, '/tcf', 0.0), 0.504), ((3, '/tcf', 0.0), 0.528),
                                       ((-2, '/tcf', 0.0), 0.512), ((0, '', 0.1), 0.608),
                                       ((0, '', -0.2), 0.408), ((1, '/image', 0.0), 0.440)):
                answer = player.call('step', Step, *arguments)
                self.assertTrue(answer.success, answer.message)
                listener.wait_for(lambda shown_s=shown_s: times(listener)[-1] == shown_s,
                                  f'{shown_s} after {arguments}')

    def test_what_cannot_be_met_changes_nothing_and_says_why(self) -> None:
        with Player(self.bag, '--pause', '-s', '0.5') as player:
            before = player.wait_for_state(lambda it: it.position == 0.5, 'the start')
            for name, service, arguments, reason in (
                    ('set_rate', SetRate, (0.0,), 'must not be 0'),
                    ('set_rate', SetRate, (NAN,), 'must be a number'),
                    ('set_rate', SetRate, (2e6,), 'from 1e-06 to 1e+06'),
                    ('seek', Seek, (NAN,), 'must be a number'),
                    ('seek', Seek, (float('inf'),), 'must be a number'),
                    ('step', Step, (0, '', 0.0), 'a count'),
                    ('step', Step, (1, '/nothing', 0.0), 'not in the recording'),
                    ('set_loop', SetLoop, (True, 0.5, 0.4), 'at least'),
                    ('set_loop', SetLoop, (True, NAN, 0.4), 'must be a number')):
                answer = player.call(name, service, *arguments)
                self.assertFalse(answer.success, (name, arguments))
                self.assertIn(reason, answer.message)
            after = player.wait_for_state(lambda it: it.stamp > before.stamp, 'a later state')
            for field in ('position', 'rate', 'paused', 'loop', 'segment'):
                self.assertEqual(getattr(after, field), getattr(before, field))

    def test_a_position_outside_is_moved_to_the_nearer_end(self) -> None:
        with Player(self.bag, '--pause') as player:
            for position_s, end_s in ((7.0, 1.0), (-1.0, 0.0)):
                answer = player.call('seek', Seek, position_s)
                self.assertTrue(answer.success)
                self.assertIn('outside of the recording', answer.message)
                player.wait_for_state(lambda it, end_s=end_s: abs(it.position - end_s) < 1e-9,
                                      'the end')

    def test_at_the_beginning_nothing_comes_from_elsewhere(self) -> None:
        bag = write_bag(Path(self.folder.name) / 'late.bag', [
            *self.rows, Row('/late_text', 500, String('late')),
            Row('/late_number', 600, Float32MultiArray(data=[1.0]))], latched=('/late_text',))
        with Listener('/tcf', '/image') as listener, Player(bag, '--pause', '-s', '1') as player:
            listener.wait_for(lambda: times(listener)[-1:] == [1.0], 'the end')
            listener.clear()
            answer = player.call('seek', Seek, 0.0)
            self.assertEqual(answer.message,
                             'at 0.000 s; nothing yet on /late_text, /late_number')
            listener.wait_for(lambda: bool(listener.of('/image')) and times(listener)[-1:] == [0.0],
                              'the first image, which was recorded at 4 ms')
            state = player.wait_for_state(lambda it: it.position == 0.0, 'the beginning')
            self.assertEqual(state.not_begun, ['/late_text', '/late_number'])
            with Listener('/late_text', '/tf_static') as late:
                late.wait_for(lambda: bool(late.of('/tf_static')), 'what is latched')
                self.assertEqual(frames_in(late), ['fixed0', 'fixed1'])
                self.assertEqual(late.of('/late_text'), [])
            player.call('seek', Seek, 0.55)
            player.wait_for_state(lambda it: it.not_begun == ['/late_number'], 'the middle')

    def test_pause_rate_loop_and_stop(self) -> None:
        with Player(self.bag, '-k') as player:
            self.assertTrue(player.call('set_rate', SetRate, 0.1).success)
            player.wait_for_state(lambda it: it.rate == 0.1 and not it.paused, 'playing')
            self.assertEqual(rospy.get_param('/process_visualizer/playback_rate'), 0.1)
            self.assertTrue(player.call('toggle_paused', Trigger).success)
            paused = player.wait_for_state(lambda it: it.paused, 'pause')
            again = player.wait_for_state(lambda it: it.stamp > paused.stamp, 'a later state')
            self.assertEqual(paused.position, again.position)
            self.assertEqual(again.achieved_rate, 0.0)
            self.assertTrue(player.call('set_loop', SetLoop, True, 0.2, 0.4).success)
            self.assertTrue(player.call('set_rate', SetRate, -1.0).success)
            self.assertTrue(player.call('seek', Seek, 0.3).success)
            segment = player.wait_for_state(lambda it: it.position == 0.3, 'the seek').segment
            self.assertTrue(player.call('play', Trigger).success)
            player.wait_for_state(lambda it: it.segment >= segment + 2, 'two rounds backwards')
            self.assertTrue(player.call('stop', Trigger).success)
            player.wait_for_state(lambda it: it.paused and it.position == 0.0, 'stop')

    def test_the_state_counts_the_messages_of_each_topic(self) -> None:
        def counts(state: PlayerState) -> Dict[str, int]:
            return {topic.name: topic.published for topic in state.topics}

        with Player(self.bag, '-k', '--topics', '/tcf', '/image', '/image:=/picture') as player:
            state = player.wait_for_state(
                lambda it: counts(it) == {'/tcf': 126, '/picture': 25}, 'all messages')
            self.assertEqual(state.published, 151)
            player.call('seek', Seek, 0.5)
            player.wait_for_state(lambda it: counts(it) == {'/tcf': 127, '/picture': 26},
                                  'the scene')

    def test_the_state_comes_ten_times_a_second(self) -> None:
        with Player(self.bag, '--pause') as player:
            first = player.wait_for_state(lambda it: it.paused, 'the first state')
            last = player.wait_for_state(
                lambda it: (it.stamp - first.stamp).to_sec() > 2.0, 'two seconds')
            times_s = [it.stamp.to_sec() for it in player.states]
            self.assertLess(np.median(np.diff(times_s)), 0.1)  # once the machine may be late
            self.assertEqual(last.files, [self.bag])
            self.assertAlmostEqual(last.duration, 1.0)
            self.assertEqual(last.begin.secs, 1_600_000_000)

    def test_choice_prefix_and_remapping(self) -> None:
        topics = ('/old/tcf', '/tcf', '/other', '/old/other', '/old/text', '/old/image')
        with Listener(*topics) as listener, \
                Player('-d', '2', '-p', 'old', '--exclude', '/im*', '--topics', '/text',
                       '/tcf', '/image', '--bags', self.bag, '/tcf:=/other') as player:
            self.assertEqual(player.wait()[0], 0)
            listener.wait_for(lambda: len(listener.of('/old/other')) >= 126, '/old/other')
        self.assertEqual({it.topic for it in listener.received}, {'/old/other', '/old/text'})

    def test_definitions_that_differ_are_left_out_with_a_message(self) -> None:
        class OldImage(Image):
            """An image as another version of its package defines it."""

            _md5sum = '0' * 32

        image = rospy.Publisher('/image', OldImage, queue_size=1)
        try:
            with Player(self.bag, '-r', '4') as player:
                _, output = player.wait()
        finally:
            image.unregister()
        self.assertIn('/image: left out, as the definition of sensor_msgs/Image', output)

    def test_types_that_are_in_use_are_left_out_with_a_message(self) -> None:
        text = rospy.Publisher('/tcf', String, queue_size=1)
        info = rospy.Publisher('/info', CameraInfo, queue_size=1)
        image = rospy.Publisher('/image', Image, queue_size=1)
        try:
            with Player(self.bag, '-r', '4') as player:
                code, output = player.wait()
        finally:
            for publisher in (text, info, image):
                publisher.unregister()
        self.assertEqual(code, NOT_ALL)
        self.assertIn('/tcf: left out, as it is std_msgs/Float32MultiArray in the recording, but '
                      'std_msgs/String where /', output)
        self.assertNotIn('/image: left out', output)
        with Listener('/tcf') as listener, Player(self.bag, '-d', '2', '-r', '4') as player:
            listener.wait_for(lambda: bool(times(listener)), 'the topic once nobody else has it')

    def test_simulated_time(self) -> None:
        with Listener('/clock', '/image') as listener, \
                Player(self.bag, '-d', '2', '--clock', '--hz', '50', '--pause') as player:
            listener.wait_for(lambda: len(listener.of('/clock')) > 10, 'a clock while paused')
            player.call('seek', Seek, 0.9)
            listener.wait_for(lambda: bool(listener.of('/image')), 'an image')
            recorded = [row for row in self.of('/image') if row.time_ms <= 900][-1]
            self.assertEqual(listener.of('/image')[-1], serialised(recorded.message))
            listener.clear()
            player.call('seek', Seek, 0.1)
            listener.wait_for(lambda: len(listener.of('/image')) >= 2, 'the scene twice')
            clocks = [struct.unpack('<II', data) for data in listener.of('/clock')]
            self.assertEqual(clocks[-1], (1_600_000_000, 100_000_000))
            player.call('play', Trigger)
            self.assertEqual(player.wait()[0], 0)


    def test_the_clock_goes_back_once_at_a_seek_back_while_it_plays(self) -> None:
        bag = write_bag(Path(self.folder.name) / 'long.bag', cell_rows(4000))
        with Listener('/clock', '/tcf') as listener, Player(bag, '--clock', '-d', '2') as player:
            listener.wait_for(lambda: times(listener)[-1:] > [2.0], 'two seconds')
            player.call('seek', Seek, 1.0)
            listener.wait_for(lambda: falls(times(listener)) and times(listener)[-1] > 2.5,
                              'what follows the seek')
            clocks_s = [secs - 1_600_000_000 + nsecs * 1e-9 for secs, nsecs
                        in (struct.unpack('<II', data) for data in listener.of('/clock'))]
            shown_s = times(listener)[falls(times(listener))[0]:]
        self.assertEqual(len(falls(clocks_s)), 1)
        self.assertAlmostEqual(clocks_s[falls(clocks_s)[0]], 1.0, delta=0.1)
        self.assertEqual(sorted({time_s for time_s in shown_s if time_s < 2.0}),
                         [round(0.008 * number, 4) for number in range(124, 250)])

    def test_the_clock_has_the_frequency_that_was_asked_for(self) -> None:
        with Listener('/clock') as listener, Player(self.bag, '--clock', '--pause') as player:
            player.wait_for_state(lambda it: it.paused, 'the beginning')
            listener.wait_for(lambda: len(listener.received) > 300, 'three seconds')
            times_s = [it.time_s for it in listener.received]
        # In a quarter of all spans of 20 nothing held the machine up. A period that begins anew
        # with each message made 0.21 s of all of them.
        spans_s = np.array(times_s[20:]) - np.array(times_s[:-20])
        self.assertAlmostEqual(float(np.quantile(spans_s, 0.25)), 0.2, delta=0.004)


if __name__ == '__main__':
    rospy.init_node('bag_player_test')
    rostest.rosrun('process_visualizer', 'bag_player_test', BagPlayerTest)
