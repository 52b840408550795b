# SPDX-License-Identifier: BSD-3-Clause
"""A view with every display type, each at a position of its own, and an analysis of its picture."""
from __future__ import annotations

import subprocess
from typing import Any, Dict, Tuple

import numpy as np
import yaml
from display_data import IMAGE_COLORS, JOINT
from geometry_msgs.msg import TransformStamped

from process_visualizer.cell.elements import DISPLAY_TYPES
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.rviz.displays import device_displays

DEVICE, FIXED_FRAME = 'displays', 'world'
ROBOT = f"""<robot name="r">
  <link name="robotmodel"><visual><geometry><box size="0.2 0.2 0.2" /></geometry></visual></link>
  <link name="effort" />
  <joint name="{JOINT}" type="revolute">
    <parent link="robotmodel" /><child link="effort" /><axis xyz="0 0 1" />
    <limit lower="-1" upper="1" effort="1" velocity="1" />
  </joint>
</robot>"""
"""Each link is at the position of the display that shows it."""
_COLUMNS = 6
_PIXELS_PER_M = 90.0
_BACKGROUND = (12, 34, 56)
ORIGIN = 'origin'
"""A position without a display: the origin of the fixed frame."""
_HALF_PLACE_M = 0.4
_SQUARES = '<property name="Style" value="Flat Squares"/><property name="Size (m)" value="0.1"/>'
_SMALL_GRID = """<property name="Cell Size" value="0.2"/>
  <property name="Plane Cell Count" value="2"/><property name="Alpha" value="1"/>"""
_PROPERTIES = {
    'Axes': '<property name="Reference Frame" value="axes"/><property name="Length" value="0.3"/>',
    'DepthCloud': f'<property name="Color Image Topic" value="/{DEVICE}/depthcloud/color"/>',
    'Grid': f'<property name="Reference Frame" value="grid"/>{_SMALL_GRID}',
    'Group': '<rviz type="Grid" name="Inner">'
             f'<property name="Reference Frame" value="group"/>{_SMALL_GRID}</rviz>',
    'TF': '<property name="Show Arrows" value="false"/><property name="Frames">' + ''.join(
        f'<property name="{frame}" value="{str(frame == "tf").lower()}"/>'
        for frame in (FIXED_FRAME, *(name.lower() for name in DISPLAY_TYPES))) + '</property>',
    **{name: '<property name="Arrow Width" value="0.1"/>' for name in (
        'AccelStamped', 'TwistStamped', 'WrenchStamped')},
    **{name: _SQUARES for name in ('FluidPressure', 'Illuminance', 'LaserScan', 'PointCloud',
                                   'RelativeHumidity', 'Temperature')},
}
"""Settings that make a display small, or large enough to see; the generator sets the rest."""


def topic(name: str) -> str:
    """Return what a display shows: a topic, the robot model's parameter, or '' if it shows none."""
    last = {'InteractiveMarkers': 'update'}.get(name, 'data')
    if name == 'RobotModel':
        return f'/{DEVICE}/robot_description'
    return '' if DISPLAY_TYPES[name].topic_key is None else f'/{DEVICE}/{name.lower()}/{last}'


def view_text(folder: str) -> str:
    """The .rviz file: the displays of the project's generator, seen from above."""
    views = {'Current': {'Class': 'rviz/TopDownOrtho', 'Name': 'Current View',
                         'Scale': _PIXELS_PER_M, 'X': 0.0, 'Y': 0.0, 'Angle': 0.0,
                         'Target Frame': FIXED_FRAME}}
    manager = {
        'Class': '', 'Views': views, 'Displays': [*_displays(folder), {
            'Class': 'process_visualizer/DisplayStatus', 'Name': 'Report', 'Enabled': True}],
        'Global Options': {'Fixed Frame': FIXED_FRAME,
                           'Background Color': '; '.join(map(str, _BACKGROUND))}}
    return str(yaml.safe_dump({
        'Panels': [], 'Visualization Manager': manager,
        'Window Geometry': {'Width': 1580, 'Height': 980, 'X': 0, 'Y': 0},
        'Preferences': {'PromptSaveOnExit': False}}))


def _displays(folder: str) -> 'list[Dict[str, Any]]':
    elements = ''
    for name in DISPLAY_TYPES:
        shown = f'topic="{topic(name)}"' if topic(name) else ''
        elements += f'<rviz type="{name}" name="{name}" {shown}>{_PROPERTIES.get(name, "")}</rviz>'
    path = f'{folder}/displays.xml'
    with open(path, 'w', encoding='utf-8') as file:
        file.write(f'<visualizer><device type="other" name="{DEVICE}">{elements}</device>'
                   '</visualizer>')
    return device_displays(XmlParser().parse(path).devices[0])


def frames() -> 'list[TransformStamped]':
    """Return the transforms of the displays' frames in the fixed frame."""
    transforms = []
    for name in DISPLAY_TYPES:
        transform = TransformStamped(child_frame_id=name.lower())
        transform.header.frame_id = FIXED_FRAME
        transform.transform.translation.x, transform.transform.translation.y = _place_m(name)
        transform.transform.rotation.w = 1.0
        transforms.append(transform)
    return transforms


def _place_m(name: str) -> Tuple[float, float]:
    row, column = divmod(list(DISPLAY_TYPES).index(name), _COLUMNS)
    return column - 0.5 * (_COLUMNS - 1), 0.5 * (_COLUMNS - 1) - row


def drawn_pixels(picture: str) -> Dict[str, int]:
    """Return the number of pixels at each display, and at the origin, that are not the background.

    Images have panels of their own instead; there it is the number of pixels of their color.
    """
    pixels = picture_pixels(picture)
    drawn = (pixels != _BACKGROUND).any(axis=2)
    rows, columns = np.nonzero(~drawn)  # only the 3D view has this background
    middle = 0.5 * (columns.min() + columns.max() + 1), 0.5 * (rows.min() + rows.max() + 1)
    half = int(_HALF_PLACE_M * _PIXELS_PER_M)
    counts = {}
    for name, (x, y) in {ORIGIN: (0.0, 0.0), **{it: _place_m(it) for it in DISPLAY_TYPES}}.items():
        column, row = int(middle[0] + _PIXELS_PER_M * x), int(middle[1] - _PIXELS_PER_M * y)
        counts[name] = int(drawn[row - half:row + half, column - half:column + half].sum())
    counts.update((name, int((pixels == color).all(axis=2).sum()))
                  for name, color in IMAGE_COLORS.items())
    return counts


def picture_pixels(picture: str) -> np.ndarray:
    """Return the colors (height, width, 3) of a picture file."""
    text = subprocess.run(['identify', '-format', '%w %h', picture], stdout=subprocess.PIPE,
                          check=True, text=True).stdout
    width, height = map(int, text.split())
    raw = subprocess.run(['convert', picture, '-depth', '8', 'rgb:-'], stdout=subprocess.PIPE,
                         check=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(height, width, 3)
