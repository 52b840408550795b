# SPDX-License-Identifier: BSD-3-Clause
"""Views that the operator saved: files, and their changes of the generated view."""
from __future__ import annotations

import copy
from pathlib import Path
from typing import Any, Callable, Dict

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.cell.model import Cell, Mode
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.generator import generate, generate_parts
from process_visualizer.generate.plan import RVIZ_FILE, RVIZ_PART
from process_visualizer.rviz.views import (
    SavedViewError,
    SavedViews,
    merged_view,
    onlooker_view,
    view_warnings,
)
from process_visualizer.rviz.window_geometry import Rectangle, window_geometry

VIEW = 'Visualization Manager: {Displays: []}\n'
TEXT = ('<device type="depth_sensor" name="cam"><topic name="c" type="pointcloud"/>'
        '<rviz type="Axes"/></device>')
WINDOW = Rectangle(440, 0, 840, 768)
Config = Dict[str, Any]


@pytest.fixture(autouse=True)
def ros_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder that contains the saved views."""
    monkeypatch.setenv('ROS_HOME', str(tmp_path / 'home'))
    return tmp_path / 'home'


@pytest.fixture
def views() -> SavedViews:
    """The views of two devices."""
    return SavedViews('/folder/cell.xml', ['a', 'b'])


@pytest.fixture
def view_file(tmp_path: Path) -> str:
    """A file as RViz writes it."""
    path = tmp_path / 'written.rviz'
    path.write_text(VIEW)
    return str(path)


@pytest.fixture
def generated(parse: Callable[[str], Cell]) -> Config:
    """The generated view of a camera."""
    cell = parse(TEXT)
    text = generate(Choice(cell, Mode.REALTIME, cell.devices)).files[RVIZ_FILE]
    return dict(yaml.safe_load(text))


def displays(config: Config) -> Config:
    """All displays by name, including those in groups."""
    found: Config = {}

    def add(items: Any) -> None:
        for item in items:
            found[item['Name']] = item
            add(item.get('Displays', []))
    add(config['Visualization Manager']['Displays'])
    return found


def test_no_views(views: SavedViews) -> None:
    assert (views.names(), views.chosen()) == ([], None)
    views.choose(None)


@pytest.mark.parametrize('name', ['From above', '../../x', 'a/b', '.hidden', 'Größe 1.5', '%2F',
                                  "it's; $(x)"])
def test_saved_view_comes_back(name: str, views: SavedViews, view_file: str) -> None:
    views.save(name, view_file)
    assert (views.names(), views.chosen()) == ([name], name)
    assert views.load(name) == yaml.safe_load(VIEW)
    assert sorted(path.parent for path in views.folder.rglob('*')) == [views.folder] * 2
    views.remove(name)
    assert (views.names(), views.chosen()) == ([], None)


def test_views_belong_to_a_choice_of_devices(views: SavedViews, view_file: str) -> None:
    views.save('x', view_file)
    assert SavedViews('/folder/../folder/cell.xml', ['b', 'a']).names() == ['x']
    assert SavedViews('/folder/cell.xml', ['a']).names() == []
    assert SavedViews('/other/cell.xml', ['a', 'b']).names() == []


def test_choice_between_views(views: SavedViews, view_file: str) -> None:
    views.save('one', view_file)
    views.save('two', view_file)
    assert views.chosen() == 'two'
    views.choose('one')
    assert SavedViews('/folder/cell.xml', ['a', 'b']).chosen() == 'one'
    views.remove('two')
    assert views.chosen() == 'one'
    views.choose(None)
    assert (views.chosen(), views.names()) == (None, ['one'])


def test_view_is_replaced(views: SavedViews, view_file: str) -> None:
    views.save('x', view_file)
    Path(view_file).write_text('Visualization Manager: {new: 1}')
    views.save('x', view_file)
    assert views.load('x') == {'Visualization Manager': {'new': 1}}


@pytest.mark.parametrize('text', ['', '{', 'Panels: []', '\x00'])
def test_what_is_no_view_is_not_saved(text: str, views: SavedViews, view_file: str) -> None:
    views.save('x', view_file)
    Path(view_file).write_text(text)
    with pytest.raises(SavedViewError, match='the view "x" cannot be saved: '):
        views.save('x', view_file)
    assert views.load('x') == yaml.safe_load(VIEW)


def test_errors(views: SavedViews, view_file: str, ros_home: Path) -> None:
    with pytest.raises(SavedViewError, match='a view needs a name'):
        views.save('  ', view_file)
    with pytest.raises(SavedViewError, match='"x" cannot be read: No such file'):
        views.load('x')
    with pytest.raises(SavedViewError, match='"x" cannot be removed: No such file'):
        views.remove('x')
    with pytest.raises(SavedViewError, match='"x" cannot be saved: No such file'):
        views.save('x', view_file + 'gone')
    ros_home.rmdir() if ros_home.is_dir() else None
    ros_home.write_text('a file')
    with pytest.raises(SavedViewError, match='"x" cannot be saved: '):
        views.save('x', view_file)


def test_view_as_it_was_generated(generated: Config) -> None:
    assert merged_view(generated, generated) == generated
    assert merged_view(generated, {'Visualization Manager': {}}) == generated


def test_what_the_operator_sets_is_kept(generated: Config) -> None:
    saved = copy.deepcopy(generated)
    manager = saved['Visualization Manager']
    manager['Views']['Current'] = {'Class': 'rviz/TopDownOrtho', 'Scale': 80}
    manager['Global Options']['Background Color'] = '1; 2; 3'
    displays(saved)['Points']['Size (Pixels)'] = 9
    displays(saved)['Axes']['Enabled'] = False
    manager['Displays'].append({'Class': 'rviz/TF', 'Name': 'My frames', 'Enabled': True})
    saved['Panels'] = [{'Class': 'rviz/Time', 'Name': 'Time'}]
    merged = merged_view(generated, saved)
    assert merged == {**saved, 'Visualization Manager': {
        **manager, 'Displays': merged['Visualization Manager']['Displays']}}
    assert displays(merged) == displays(saved)


def test_markers_of_earlier_views_are_not_shown_twice() -> None:
    ours, his = ({'Visualization Manager': {'Displays': [
        {'Class': f'{library}/MarkerArray', 'Name': 'Arrows and numbers', 'Enabled': enabled}]}}
        for library, enabled in (('process_visualizer', True), ('rviz', False)))
    (display,) = merged_view(ours, his)['Visualization Manager']['Displays']
    assert (display['Class'], display['Enabled']) == ('process_visualizer/MarkerArray', False)


def test_displays_of_one_name_are_all_kept(generated: Config) -> None:
    saved = copy.deepcopy(generated)
    shown = saved['Visualization Manager']['Displays']
    twins = [{'Class': 'rviz/TF', 'Name': 'TF', 'Frames': number} for number in range(3)]
    points = {'Class': 'rviz/PointCloud2', 'Name': 'Points', 'Topic': '/a'}
    shown += [twins[0], points, twins[1], points, twins[2]]
    assert merged_view(generated, saved) == saved
    for _ in twins:  # the first ones are merged with the generated ones
        generated['Visualization Manager']['Displays'].append({'Class': 'rviz/TF', 'Name': 'TF'})
        merged = merged_view(generated, saved)['Visualization Manager']['Displays']
        assert [it['Frames'] for it in merged if it['Name'] == 'TF'] == [0, 1, 2]


def test_what_the_configuration_says_is_kept(generated: Config) -> None:
    saved = copy.deepcopy(generated)
    displays(saved)['Points']['Topic'] = '/old/points'
    saved['Visualization Manager']['Global Options']['Fixed Frame'] = 'old_world'
    saved['Preferences'] = {'PromptSaveOnExit': True}
    group = saved['Visualization Manager']['Displays'][1]
    group['Displays'] = [it for it in group['Displays'] if it['Name'] != 'Axes']
    assert merged_view(generated, saved) == generated


VALUES = st.recursive(st.none() | st.integers() | st.text(max_size=5),
                      lambda inner: st.lists(inner, max_size=3) | st.dictionaries(
                          st.sampled_from(['Displays', 'Class', 'Name', 'Global Options', 'x']),
                          inner, max_size=3), max_leaves=10)


@given(VALUES, VALUES, VALUES)
def test_files_that_a_hand_has_broken(options: Any, shown: Any, window: Any) -> None:
    """The generated displays survive any content of the file."""
    ours = {'Visualization Manager': {
        'Global Options': {'Fixed Frame': 'world'},
        'Displays': [{'Class': 'rviz/Group', 'Name': 'cam', 'Displays': [
            {'Class': 'rviz/PointCloud2', 'Name': 'Points', 'Topic': '/cam/points'}]}]}}
    merged = merged_view(ours, {'Window Geometry': window, 'Visualization Manager': {
        'Displays': shown, 'Global Options': options}})
    manager = merged['Visualization Manager']
    assert manager['Global Options']['Fixed Frame'] == 'world'
    assert manager['Displays'][0]['Displays'][0]['Topic'] == '/cam/points'


ORBIT = {'Class': 'rviz/Orbit', 'Target Frame': '<Fixed Frame>', 'Distance': 5.0}


@pytest.mark.parametrize('camera', [
    {}, {'Distance': 'far'}, {'Distance': 10 ** 400}, {'Distance': [5.0]}, {'Focal Point': [0, 0]},
    {'Focal Point': {'X': 'left', 'Y': None}}, {'Pitch': {}, 'Yaw': float('nan')}])
@pytest.mark.parametrize('window', [
    ['Width', 800], 'wide', None, {'Width': 'wide', 'Height': []}, {'Width': '800', 'Height': 600}])
def test_a_view_that_a_hand_has_broken_is_checked(parse: Callable[[str], Cell], window: Any,
                                                  camera: Config) -> None:
    content = {'Window Geometry': window,
               'Visualization Manager': {'Views': {'Current': {**ORBIT, **camera}}}}
    extent = {'cam': np.array([[1000.0, 1000.0, 1000.0]])}
    [warning] = view_warnings(parse(TEXT), 'mine', content, extent)
    assert '"cam" is not visible in the chosen view "mine"' in str(warning)
    seen = view_warnings(parse(TEXT), 'mine', content, {'cam': np.zeros((1, 3))})
    assert bool(seen) == (camera.get('Distance', 5.0) != 5.0)


@pytest.mark.parametrize('content', [
    {'Views': ['Current']}, {'Views': {'Current': 'Orbit'}}, {'Views': None}])
def test_a_view_without_a_camera_is_not_checked(parse: Callable[[str], Cell],
                                                content: Config) -> None:
    extent = {'cam': np.array([[1000.0, 1000.0, 1000.0]])}
    assert view_warnings(parse(TEXT), 'mine', {'Visualization Manager': content}, extent) == []


@given(VALUES, VALUES, VALUES)
def test_onlookers_see_what_is_left_of_a_broken_view(shown: Any, tools: Any, group: Any) -> None:
    grid = {'Class': 'rviz/Grid', 'Name': 'Grid'}
    broken = [grid, {'Class': 'rviz/Group', 'Displays': group}]
    for displays in (shown, [shown, *broken]):
        seen = onlooker_view({'Visualization Manager': {'Displays': displays, 'Tools': tools}})
        assert (grid in seen['Visualization Manager']['Displays']) == (displays != shown)


def test_choice_with_window_and_view(parse: Callable[[str], Cell], generated: Config) -> None:
    saved = copy.deepcopy(generated)
    displays(saved)['Points']['Size (Pixels)'] = 9
    cell = parse(TEXT)
    plain = generate_parts(Choice(cell, Mode.REALTIME, cell.devices))
    plan = generate_parts(Choice(cell, Mode.REALTIME, cell.devices, window=WINDOW, view=saved))
    config = yaml.safe_load(plan.files[RVIZ_FILE])
    assert displays(config)['Points']['Size (Pixels)'] == 9
    assert config['Window Geometry'] == window_geometry(WINDOW, saved['Window Geometry'])
    assert plan.parts[RVIZ_PART] == plain.parts[RVIZ_PART]  # RViz need not be restarted
