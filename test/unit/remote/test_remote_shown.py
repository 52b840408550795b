# SPDX-License-Identifier: BSD-3-Clause
"""Views, models and offers of another cell: they are data, of which only visible parts are used."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Dict

import pytest
import yaml

from process_visualizer.remote.offer import (
    Offer,
    OfferedMesh,
    OfferedTopic,
    digest_of,
    named_topics,
    offer_of,
    topics_message,
    topics_of,
)
from process_visualizer.remote.shown_view import (
    fixed_frame,
    mesh_paths,
    model_parameters,
    offered_meshes,
    shown_models,
    shown_view,
)

OWN: Dict[str, Any] = {'Panels': ['own'], 'Visualization Manager': {
    'Displays': [{'Class': 'rviz/Grid'}], 'Global Options': {'Frame Rate': 30},
    'Tools': [{'Class': 'rviz/MoveCamera'}]}}
CELL_MESH = 'package://process_visualizer/meshes/none.stl'
URDF = '''<robot name="r"><link name="a"><visual><geometry><mesh filename="{}"/></geometry>
</visual></link></robot>'''


def view(*displays: Dict[str, Any], **more: Any) -> str:
    return yaml.safe_dump({'Panels': [{'Class': 'evil/Panel'}], 'Visualization Manager': {
        'Displays': list(displays), 'Global Options': {'Fixed Frame': 'cell'},
        'Tools': [{'Class': 'evil/Tool'}],
        'Views': {'Current': {'Class': 'rviz/Orbit', 'Distance': 7}}, **more}})


def test_displays_frame_and_camera_are_those_of_the_cell_the_rest_is_ours() -> None:
    shown = shown_view(view({'Class': 'rviz/Group', 'Displays': [
        {'Class': 'rviz/RobotModel', 'Robot Description': 'arm/robot_description'}]}), OWN)
    manager = shown['Visualization Manager']
    assert [it['Class'] for it in manager['Displays']] == [
        'rviz/Group', 'process_visualizer/MarkerArray']
    assert fixed_frame(shown) == 'cell'
    assert manager['Views']['Current']['Distance'] == 7
    assert manager['Tools'] == [{'Class': 'rviz/MoveCamera'}]
    assert shown['Panels'] == ['own']
    assert manager['Global Options']['Frame Rate'] == 30


def test_what_is_unknown_publishes_or_takes_memory_is_not_taken() -> None:
    shown = shown_view(view(
        {'Class': 'evil/Display'}, {'Class': 'rviz/InteractiveMarkers'},
        {'Class': 'rviz/Grid', 'Plane Cell Count': 10 ** 9},
        {'Class': 'rviz/Image', 'Transport Hint': 'evil'}), OWN)
    grid, image, _ = shown['Visualization Manager']['Displays']
    assert grid == {'Class': 'rviz/Grid', 'Plane Cell Count': 1000}
    assert image['Transport Hint'] == 'raw'


@pytest.mark.parametrize('text', [
    '', '[1]', 'a: b', 'Visualization Manager: 3', '{', '!!python/object:os.system {}',
    'a: &a [x, x]\nb: &b [*a, *a, *a, *a, *a, *a, *a, *a, *a]\n' + ''.join(
        f'{chr(99 + n)}: &{chr(99 + n)} [{", ".join(9 * ["*" + chr(98 + n)])}]\n'
        for n in range(9)),
    '[' * 2000, 'x' * (3 << 20)])
def test_what_is_no_view_is_told(text: str) -> None:
    with pytest.raises(ValueError, match='it'):
        shown_view(text, OWN)


def test_parameters_of_models_are_found_in_the_view() -> None:
    text = view({'Class': 'rviz/RobotModel', 'Robot Description': 'arm/robot_description'})
    assert model_parameters(text) == ['/arm/robot_description']


def test_a_mesh_that_is_not_here_is_wanted_under_a_name_of_ours(tmp_path: Path) -> None:
    models = {'/arm/robot_description': URDF.format(CELL_MESH)}
    shown = shown_models(models, {CELL_MESH: OfferedMesh(3, 'abc')}, str(tmp_path))
    assert shown.wanted == {CELL_MESH: str(tmp_path / '0.stl')}
    assert f'file://{tmp_path}/0.stl' in shown.texts['/arm/robot_description']


@pytest.mark.parametrize('uri', [
    'file:///etc/passwd', 'http://example.com/a.stl', '/etc/shadow', 'package://nope/a.stl'])
def test_a_mesh_that_the_cell_does_not_offer_goes_with_its_visual(uri: str, tmp_path: Path
                                                                  ) -> None:
    shown = shown_models({'/d': URDF.format(uri)}, {}, str(tmp_path))
    assert shown.left_out == (uri,)
    assert 'visual' not in shown.texts['/d']
    assert not shown.wanted


def test_only_meshes_of_models_are_given_away(tmp_path: Path) -> None:
    mesh, secret = tmp_path / 'a.stl', tmp_path / 'secret.txt'
    mesh.write_bytes(b'solid')
    secret.write_bytes(b'secret')
    paths = mesh_paths({'/a': URDF.format(f'file://{mesh}'),
                        '/b': URDF.format(f'file://{secret}'), '/c': '<robot'})
    assert paths == {f'file://{mesh}': str(mesh)}
    assert offered_meshes(paths) == {f'file://{mesh}': OfferedMesh(5, digest_of(b'solid'))}


@pytest.mark.parametrize('text', [
    '<robot', '<a/>', '<!DOCTYPE x><robot/>',
    pytest.param('<robot>' + '<a>' * 1000 + '</a>' * 1000 + '</robot>', id='nested')])
def test_what_is_no_model_is_told(text: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match='a model'):
        shown_models({'/d': text}, {}, str(tmp_path))


def test_an_offer_is_the_same_at_the_other_side() -> None:
    offer = Offer('0.1', 'realtime', 'view', {'/arm/robot_description': '<robot/>'},
                  {'a': OfferedMesh(1, 'b')})
    assert offer_of(offer.values()) == offer


@pytest.mark.parametrize('change', [
    {'models': {'a b': ''}}, {'models': {'/a': 3}}, {'models': []}, {'meshes': {'a': [-1, 'b']}},
    {'meshes': {'a': [1 << 40, 'b']}}, {'meshes': {'a': [1, 2]}}, {'meshes': {'a': 'b'}},
    {'view': 3}, {'version': None}])
def test_what_is_no_offer_is_told(change: Dict[str, Any]) -> None:
    values = Offer('', '', '', {}, {}).values()
    with pytest.raises(ValueError, match=''):
        offer_of({**values, **change})


@pytest.mark.parametrize('name, kind', [
    ('tf', 'a/B'), ('/a b', 'a/B'), ('/a', 'a/../B'), ('/a', 'B'), ('/a\n', 'a/B')])
def test_names_and_types_of_topics_are_checked(name: str, kind: str) -> None:
    with pytest.raises(ValueError, match=''):
        topics_of({'topics': {name: [kind, '0' * 32, '']}})


@pytest.mark.parametrize('topics', [
    None, [], {'/a': 'a/B'}, {'/a': ['a/B', '0' * 32]}, {'/a': ['a/B', 7, '']},
    {'/a': ['a/B', 'z' * 32, '']}, {f'/a{it}': ['a/B', '0' * 32, ''] for it in range(2001)}])
def test_topics_that_nobody_can_offer(topics: Any) -> None:
    with pytest.raises(ValueError, match='topic'):
        topics_of({'topics': topics})


def test_topics_are_the_same_at_the_other_side() -> None:
    topics = {'/tf': OfferedTopic('tf2_msgs/TFMessage', '0a' * 16, 'transforms')}
    assert topics_of({'topics': topics_message(topics)}) == topics


def test_names_that_stand_in_a_view() -> None:
    names = {'Displays': [{'Topic': '/points', 'Size': 3, 'Queue': None},
                          {'Parts': [{'Marker Topic': '/arm/tool'}], 'Name': 'a/b'}],
             'Path': '/not a name'}
    assert list(named_topics(names)) == ['/points', '/arm/tool']
