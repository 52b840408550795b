# SPDX-License-Identifier: BSD-3-Clause
"""The runs that ``cell new`` proposes for a recorded process."""
from __future__ import annotations

from pathlib import Path
from typing import Dict, List, Tuple

import genpy
import numpy as np
import pytest
import rosbag
from genpy.dynamic import generate_dynamic
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float32, Int32, String, UInt8

from process_visualizer.bagio.recorder_topics import CONFIGURATION
from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.stored_configuration import configuration_text
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.commands.command_line import main
from process_visualizer.discovery.process import StateNumber, proposed_process, recorded_states

STATES = (10, 20, 30, 40, 50)
PERIOD_S, REST_S = 0.05, 1.0
PLC = 'bool busy\nint32 state\nuint8 variant\nplc_msgs/Lamps lamps\n' + '=' * 80 + \
    '\nMSG: plc_msgs/Lamps\nbool ok\nuint8[] others\n'


def durations_s(random: np.random.Generator) -> List[float]:
    """Durations of the states of a run; in the second state it waits for an operator."""
    usual = [0.8, 3.0, 1.5, 2.0, 0.6] * (1.0 + 0.01 * random.standard_normal(5))
    return [float(usual[0]), float(random.uniform(1.0, 6.0)), *map(float, usual[2:])]


def recorded(path: Path, runs: int, is_custom: bool, wait: bool = True, count: int = 3) -> str:
    """A bag of a process with a bit, a state, a position in a pattern, a variant and a counter."""
    random, now_s = np.random.default_rng(1), 0.0
    plc = generate_dynamic('plc_msgs/Plc', PLC)['plc_msgs/Plc']
    with rosbag.Bag(str(path), 'w') as bag:
        def send(topic: str, message: object, late_s: float = 0.0) -> None:
            bag.write(topic, message, genpy.Time.from_sec(1000.0 + now_s + late_s))
        for run in range(runs):
            variant, place = int(random.integers(2)), run % count
            took_s = durations_s(random)
            took_s[1] = took_s[1] if wait else 3.0
            rows = [(0, REST_S), *zip(STATES, took_s), (0, REST_S)]
            for state, length_s in rows:
                for _ in range(int(length_s / PERIOD_S)):
                    now_s += PERIOD_S
                    is_busy = state > 0
                    if is_custom:
                        message = plc(busy=is_busy, state=state, variant=variant)
                        message.lamps.ok = state >= 40
                        send('/plc/status', message)
                    else:
                        for row, (topic, it) in enumerate((
                                ('busy', Bool(is_busy)), ('state', Int32(state)),
                                ('variant', UInt8(variant)), ('pattern_index', UInt8(place)),
                                ('parts', Int32(run)), ('gripper', Bool(20 <= state <= 40)))):
                            send(f'/plc/{topic}', it, 0.002 * row)
                    send('/oven/heat', Float32(200.0 + random.standard_normal()), 0.001)
                    send('/joint_states', JointState(name=['a'], position=[now_s]), 0.003)
    return str(path)


def proposed(folder: Path, bag: str, capsys: pytest.CaptureFixture[str]) -> Tuple[str, str]:
    """The text of the configuration, and the printed output."""
    path = folder / 'cell.xml'
    assert main(['new', bag, '-o', str(path)]) == 0
    said = capsys.readouterr().out
    XmlParser().parse(str(path))
    return path.read_text(encoding='utf-8'), said


def test_runs_phases_and_groups_are_proposed(tmp_path: Path,
                                             capsys: pytest.CaptureFixture[str]) -> None:
    bag = recorded(tmp_path / 'a.bag', 12, False)
    text, said = proposed(tmp_path, bag, capsys)
    assert '12 runs of ' in said and 'from "busy begins" to "busy ends"' in said
    assert '<event name="busy begins" topic="/plc/busy" above="0.5" />' in text
    assert ('<run begin="busy begins" end="busy ends" group="plc/variant" '
            'place="plc/pattern_index" />') in text
    assert '<phase name="state 20" from="state 20" to="state 30" wait="true" />' in text
    assert text.count('wait=') == 1 and text.count('<phase ') == len(STATES)
    assert 'topic="plc/state"' not in text.replace('/plc/state', '')  # it is not an arrow
    assert main(['runs', bag, '--config', str(tmp_path / 'cell.xml')]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 12 and 'plc/variant 0' in lines[0] and 'plc/pattern_index 1' in lines[1]


def test_fields_of_a_message_are_states_too(tmp_path: Path,
                                            capsys: pytest.CaptureFixture[str]) -> None:
    bag = recorded(tmp_path / 'a.bag', 8, True)
    text, _ = proposed(tmp_path, bag, capsys)
    assert '<event name="busy begins" topic="/plc/status" field="busy" above="0.5" />' in text
    assert '<run begin="busy begins" end="busy ends" group="variant" />' in text
    assert 'field="lamps.ok"' in text
    assert main(['compare', f'{bag}#2', '--reference', bag, '--config',
                 str(tmp_path / 'cell.xml')]) == 0


def test_many_fields_without_numbers_are_not_all_visited(tmp_path: Path) -> None:
    definition = ''.join(
        '\n'.join(f'{inner} f{number}' for number in range(150)) + f'\n{"=" * 80}\nMSG: a/{inner}\n'
        for inner in 'BCD') + '\n'.join(f'string f{number}' for number in range(150))
    nothing = type('A', (), {'_type': 'a/A', '_md5sum': '*', '_full_text': definition})
    with rosbag.Bag(str(tmp_path / 'a.bag'), 'w') as bag:
        bag.write('/a', ('a/A', b'', '*', nothing), genpy.Time(1), raw=True)
    with Recording([str(tmp_path / 'a.bag')]) as recording:
        assert recorded_states(recording, ['/a']) == []


def test_waits_are_what_differs_much_more_than_the_rest(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, _ = proposed(tmp_path, recorded(tmp_path / 'a.bag', 6, False, wait=False), capsys)
    assert 'wait=' not in text


CELL = """<visualizer>
  <!-- by hand --><device type="other" name="plc"><topic ns="plc" name="busy"/>
    <topic ns="plc" name="state"/><topic ns="plc" name="variant"/>{more}</device>
  {run}
</visualizer>
"""


@pytest.mark.parametrize('end', ['</visualizer>', '</visualizer\n>', '</visualizer><!-- not in '
                                 'this comment: </visualizer> -->'])
@pytest.mark.parametrize('run, is_proposed', [
    ('', True), ('<event name="a" topic="plc/busy" above="0.5"/>', False)])
def test_a_stored_configuration_is_completed_with_what_a_run_is(
        tmp_path: Path, capsys: pytest.CaptureFixture[str], run: str, is_proposed: bool,
        end: str) -> None:
    bag, stored = recorded(tmp_path / 'a.bag', 6, False), tmp_path / 'stored.xml'
    stored.write_text(CELL.format(run=run, more='<topic ns="plc" name="gripper"/>').replace(
        '</visualizer>', end))
    with rosbag.Bag(bag, 'a') as file:
        file.write(f'/{CONFIGURATION.strip("/")}', String(configuration_text(
            XmlParser().parse(str(stored)))), genpy.Time(1000))
    text, said = proposed(tmp_path, bag, capsys)
    assert 'by hand' in text
    assert ('6 runs of' in said) == is_proposed == ('<run begin="busy begins"' in text)
    assert 'group="plc/variant"' in text or not is_proposed
    assert 'plc/pattern_index' not in text.partition('<visualizer')[2]  # it is in no device
    assert end in text


def test_what_happens_once_is_no_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, said = proposed(tmp_path, recorded(tmp_path / 'a.bag', 1, False), capsys)
    assert '<run' not in text and '<event' not in text and 'runs of' not in said




def state(label: str, values: np.ndarray) -> StateNumber:
    """A number that is sent 20 times a second."""
    return StateNumber(f'/{label}', 'data', PERIOD_S * np.arange(len(values)),
                       values.astype(float), label)


def attributes(*known: StateNumber) -> List[Dict[str, str]]:
    """The attributes of all proposed elements."""
    found = proposed_process(known)
    return [] if found is None else [it.attributes for it in found.elements]


PHASE = np.arange(1200) % 200  # rows of 10 s


def test_without_a_state_bits_are_phases() -> None:
    found = attributes(state('busy', PHASE > 20), state('gripper', (PHASE > 60) & (PHASE < 150)))
    assert [it['name'] for it in found if 'topic' in it] == [
        'busy begins', 'busy ends', 'gripper on', 'gripper off']
    assert found[-1] == {'name': 'gripper', 'from': 'gripper on', 'to': 'gripper off'}


def test_of_a_bit_that_is_off_during_the_run_and_of_a_pulse() -> None:
    assert {'begin': 'idle ends', 'end': 'idle begins'} in attributes(state('idle', PHASE <= 40))
    start, = (it for it in attributes(state('start', (PHASE > 20) & (PHASE < 24)))
              if 'begin' in it)
    assert start == {'begin': 'start begins', 'end': 'start begins'}


def test_an_alarm_that_came_once_does_not_matter() -> None:
    busy = state('busy', PHASE > 50)
    alarm = StateNumber('/alarm', 'data', np.array([24.0, 25.0]), np.array([1.0, 0.0]), 'alarm')
    assert {'begin': 'busy begins', 'end': 'busy ends'} in attributes(busy, alarm)


def test_a_state_alone_is_enough() -> None:
    found = attributes(state('step', np.select([PHASE < 20, PHASE < 90], [0, 3], 7)))
    assert found[:2] == [{'name': 'run begins', 'topic': '/step', 'above': '1.5'},
                         {'name': 'run ends', 'topic': '/step', 'below': '1.5'}]
    assert found[-1] == {'name': 'step 7', 'from': 'step 7', 'to': 'run ends'}


@given(st.lists(st.lists(st.integers(0, 3), min_size=2, max_size=60), min_size=1, max_size=4))
def test_whatever_is_proposed_is_named(values: List[List[int]]) -> None:
    found = attributes(*(state(f's{row}', np.repeat(it, 5)) for row, it in enumerate(values)))
    names = {it['name'] for it in found if 'topic' in it}
    for it in found:
        assert {it[end] for end in ('begin', 'end', 'from', 'to') if end in it} <= names
