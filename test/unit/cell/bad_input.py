# SPDX-License-Identifier: BSD-3-Clause
"""The table of bad configurations: the messages of each, and whether the schema can detect it."""
from __future__ import annotations

from dataclasses import dataclass
from typing import List, Tuple


@dataclass(frozen=True)
class Bad:
    """Wrong file, and the beginning of each problem's line without the file's name."""

    name: str
    text: str
    problems: Tuple[str, ...]
    schema_sees: bool = True


def _file(name: str, text: str, *problems: str, schema_sees: bool = True) -> Bad:
    return Bad(name, text, problems, schema_sees)


def _in_robot(name: str, element: str, *problems: str, schema_sees: bool = True,
              kind: str = 'robot') -> Bad:
    """``element`` is in line 3, in a device of line 2."""
    return Bad(name, f'<visualizer>\n<device type="{kind}" name="d">\n{element}\n</device>\n'
                     '</visualizer>', problems, schema_sees)


_NODE = '<node pkg="p" type="t" name="n" '

WHOLE_FILES: List[Bad] = [
    _file('empty', '', '1: the file is empty'),
    _file('blank', ' \n\n', '1: the file is empty'),
    _file('text', 'robot: arm', '1: not well-formed XML: syntax error'),
    _file('unclosed', '<visualizer>\n<device type="other" name="a">\n</visualizer>',
          '3: not well-formed XML: mismatched tag'),
    _file('cut off', '<visualizer>\n<device', '2: not well-formed XML'),
    _file('two roots', '<visualizer/>\n<visualizer/>', '2: not well-formed XML'),
    _file('attribute twice', '<visualizer>\n<device name="a" name="b"/></visualizer>',
          '2: not well-formed XML: duplicate attribute'),
    _file('undefined entity', '<visualizer>\n&file;</visualizer>',
          '2: not well-formed XML: undefined entity'),
    _file('wrong root', '<!-- robots -->\n<robot name="a"/>',
          '2: <robot>: a configuration begins with <visualizer>'),
    _file('root in capitals', '<Visualizer/>', '1: <Visualizer>: a configuration begins with'),
    _file('no device', '<visualizer/>', '1: <visualizer>: lists no device', schema_sees=False),
    _file('unknown tags', '<visualizer>\n<devcie/>\n<device type="other" name="a"><topik/>\n'
                          '<frobnicate/></device></visualizer>',
          '2: <devcie>: unknown element in <visualizer>; did you mean "device"?',
          '3: <topik>: unknown element in <device>; did you mean "topic"?',
          '4: <frobnicate>: unknown element in <device>; expected one of: arrow, base, '),
    _file('tag in the wrong place', '<visualizer>\n<topic name="a"/></visualizer>',
          '2: <topic>: is not allowed in <visualizer>; expected one of: arg, device, event, '
          'include, machine, phase, run'),
    _file('unknown attribute of the root', '<visualizer fram="x"/>',
          '1: <visualizer>: unknown attribute "fram"; did you mean "frame"?'),
    _file('missing attributes', '<visualizer>\n<device/>\n</visualizer>',
          '2: <device>: the attribute "type" is missing',
          '2: <device>: the attribute "name" is missing'),
    _file('unknown type', '<visualizer><device type="robt" name="a"/></visualizer>',
          '1: <device>: attribute "type": "robt" is not a valid value; did you mean "robot"?'),
    _file('duplicate names', '<visualizer>\n<device type="other" name="a"/>\n'
                             '<device type="robot" name="a"/></visualizer>',
          '3: <device>: a device named "a" already exists (cell.xml:2); choose another name',
          schema_sees=False),
    _file('duplicate frames', '<visualizer>\n<device type="other" name="a"><base frame="f"/>'
                              '</device>\n<device type="other" name="b"><base frame="/f"/>'
                              '</device></visualizer>',
          '3: <base>: the frame "f" already exists (cell.xml:2)', schema_sees=False),
    _file('base is the global frame', '<visualizer frame="map">\n<device type="other" name="a">'
                                      '<base frame="/map"/></device></visualizer>',
          '2: <base>: "map" is the global frame', schema_sees=False),
    _file('same node in two devices',
          f'<visualizer>\n<device type="other" name="a">{_NODE} ns="x"/></device>\n'
          f'<device type="other" name="b">{_NODE} ns="/x"/></device></visualizer>',
          '3: <node>: a node named "/x/n" already exists (cell.xml:2)', schema_sees=False),
    _file('text in the root', '<visualizer>\nhello\n</visualizer>',
          '1: <visualizer>: unexpected text "hello"'),
    _file('argument without value', '<visualizer>\n<arg name="x"/>\n'
                                    '<device type="other" name="$(arg x)"/></visualizer>',
          '2: <arg>: no value for "x"; give x:=… or a default', schema_sees=False),
    _file('argument twice', '<visualizer>\n<arg name="x" value="1"/>\n<arg name="x" value="2"/>'
                            '</visualizer>',
          '3: <arg>: the argument "x" already exists', schema_sees=False),
    _file('argument with value and default', '<visualizer>\n<arg name="x" value="1" default="2"/>'
                                             '</visualizer>',
          '2: <arg>: has both "value" and "default"; keep one', schema_sees=False),
    _file('argument used before it is declared',
          '<visualizer>\n<arg name="x" default="$(arg y)"/>\n<arg name="y" default="1"/>'
          '</visualizer>',
          '2: <arg>: attribute "default": "$(arg y)": there is no argument "y"; no <arg> is '
          'declared', schema_sees=False),
    _file('if and unless', '<visualizer>\n<device type="other" name="a" if="1" unless="0"/>'
                           '</visualizer>',
          '2: <device>: has both "if" and "unless"; keep one', schema_sees=False),
    _file('machine twice', '<visualizer>\n<machine name="m" address="a"/>\n'
                           '<machine name="m" address="b"/></visualizer>',
          '3: <machine>: a machine named "m" already exists', schema_sees=False),
    _file('password of a machine', '<visualizer>\n<machine name="m" address="pc" user="u" '
                                   'password="secret"/></visualizer>',
          '2: <machine>: the attribute "password" is not accepted: it would be visible in launch '
          'files, parameters and recordings; remove it, and let SSH use a key ("ssh-copy-id u@pc", '
          'with an agent: "ssh-add")', schema_sees=False),
    _file('unknown machine', '<visualizer>\n<machine name="lab" address="a"/>\n'
                             f'<device type="other" name="a">{_NODE} machine="lap"/></device>'
                             '</visualizer>',
          '3: <node>: there is no machine "lap"; did you mean "lab"?', schema_sees=False),
    _file('unknown machine of a device', '<visualizer>\n<machine name="lab" address="a"/>\n'
                                         '<device type="other" name="a" machine="lap"/>'
                                         '</visualizer>',
          '3: <device>: there is no machine "lap"; did you mean "lab"?', schema_sees=False),
    _file('several problems', '<visualizer>\n<device type="robot" name="a b">\n'
                              '<base frame="f" xyz="0 0"/>\n<model pkg="m"/>\n</device>\n'
                              '<device type="other" name="c">\n<rviz type="Map"/>\n</device>\n'
                              '<device type="other" name="c"/>\n</visualizer>',
          '2: <device>: attribute "name": "a b" is not a valid name',
          '3: <base>: attribute "xyz": "0 0" has 2 values',
          '4: <model>: the attribute "path" is missing',
          '7: <rviz>: a display of type "Map" needs the attribute "topic"',
          '9: <device>: a device named "c" already exists (cell.xml:6)'),
]

VALUES: List[Bad] = [
    _in_robot(f'number {number}', f'<base frame="f" xyz="{number}"/>',
              f'3: <base>: attribute "xyz": {message}')
    for number, message in (
        ('one two three', '"one" is not a number; write one such as 0.5'),
        ('0 0 nan', '"nan" is not a finite number'),
        ('0 -inf 0', '"-inf" is not a finite number'),
        ('0 0 1e999', '"1e999" is too large'),
        ('0 0', '"0 0" has 2 values; write three numbers separated by spaces'),
        ('0 0 0 0', '"0 0 0 0" has 4 values'),
        ('0', '"0" has 1 value;'),
        ('', '"" has 0 values'),
        ('0,0,0', '"0,0,0" has 1 value;'),
        ('1_0 0 0', '"1_0" is not a number'),
        ('0x1 0 0', '"0x1" is not a number'),
        ('٣ 0 0', '"٣" is not a number'))
] + [
    _in_robot(f'name {written!r}', f'<topic name="{written}"/>',
              '3: <topic>: attribute "name": "')
    for written in ('', ' a', 'a b', 'a/b', '1a', 'a-b', 'ä', 'a&#10;b')
] + [
    _in_robot('namespace', '<topic name="a" ns="b//c"/>',
              '3: <topic>: attribute "ns": "b//c" has two slashes in a row'),
    _in_robot('namespace with a space', '<topic name="a" ns="b c"/>',
              '3: <topic>: attribute "ns": "b c" is not a valid ROS name'),
    _in_robot('private namespace', _NODE + 'ns="~x"/>', '3: <node>: attribute "ns": "~x" is not'),
    _in_robot('frame', '<base frame="my frame"/>',
              '3: <base>: attribute "frame": "my frame" is not a valid frame name'),
    _in_robot('frame of slashes', '<base frame="/"/>', '3: <base>: attribute "frame": "/" is not'),
    _in_robot('package', '<model pkg="my package" path="a.urdf"/>',
              '3: <model>: attribute "pkg": "my package" is not a valid package name'),
    _in_robot('absolute path', '<model pkg="p" path="/a.urdf"/>',
              '3: <model>: attribute "path": "/a.urdf" must be a path below the package',
              schema_sees=False),
    _in_robot('path that leaves', '<model pkg="p" path="../a.urdf"/>',
              '3: <model>: attribute "path": "../a.urdf" must be', schema_sees=False),
    _in_robot('launch file that leaves', '<launch pkg="p" type="a/../../b.launch"/>',
              '3: <launch>: attribute "type": "a/../../b.launch" must be', schema_sees=False),
    _in_robot('model of another kind', '<model pkg="p" path="a.stl"/>',
              '3: <model>: "a.stl" is neither URDF nor xacro', schema_sees=False),
    _in_robot('executable', '<node pkg="p" type="bin/x" name="n"/>',
              '3: <node>: attribute "type": "bin/x" is not an executable'),
    _in_robot('boolean', '<topic name="a" record="yes"/>',
              '3: <topic>: attribute "record": "yes" is neither True nor False'),
    _in_robot('mode', _NODE + 'ifstate="playbak"/>',
              '3: <node>: attribute "ifstate": "playbak" is not a valid value; did you mean '
              '"playback"?'),
    _in_robot('display type', '<rviz type="MarkerAray"/>',
              '3: <rviz>: attribute "type": "MarkerAray" is not a valid value; did you mean '
              '"MarkerArray"?'),
    _in_robot('message type', '<topic name="a" msg="JointState"/>',
              '3: <topic>: attribute "msg": "JointState" is not a message type'),
    _in_robot('color', '<arrow quantity="force" color="gren"/>',
              '3: <arrow>: attribute "color": "gren" is not a color'),
    _in_robot('color above one', '<arrow quantity="force" color="0 0 255"/>',
              '3: <arrow>: attribute "color": "0 0 255" is not a color'),
    _in_robot('scale', '<arrow quantity="force" scale="0"/>',
              '3: <arrow>: attribute "scale": "0" must be greater than 0'),
    _in_robot('length', '<arrow quantity="force" min="-1"/>',
              '3: <arrow>: attribute "min": "-1" must not be less than 0'),
    _in_robot('field', '<variable topic="t" frame="f" field="data[]"/>',
              '3: <variable>: attribute "field": "data[]" is not a field'),
    _in_robot('axis', '<variable topic="t" frame="f" axis="up"/>',
              '3: <variable>: attribute "axis": "up" is not a direction'),
    _in_robot('axis of length zero', '<variable topic="t" frame="f" axis="0 0 0"/>',
              '3: <variable>: attribute "axis": "0 0 0" has no direction', schema_sees=False),
    _in_robot('half a color scale', '<variable topic="t" frame="f" color_begin="1"/>',
              '3: <variable>: a color scale needs color_begin, color_end and end_color; '
              'color_end and end_color is missing', schema_sees=False),
    _in_robot('color scale without length', '<variable topic="t" frame="f" color_begin="1" '
              'color_end="1" end_color="red"/>',
              '3: <variable>: color_begin and color_end are the same', schema_sees=False),
    _in_robot('limits', '<variable topic="t" frame="f" low="2" high="1"/>',
              '3: <variable>: low (2.0) is greater than high (1.0)', schema_sees=False),
    _in_robot('frame of a topic that is not tf', '<topic name="a" type="tool_center_frame" '
              'frame="tool0"/>',
              '3: <topic>: attribute "frame" belongs to msg="tf2_msgs/TFMessage"',
              schema_sees=False),
    _in_robot('parent frame of joints', '<topic name="a" type="joint_states" '
              'parentframe="base"/>',
              '3: <topic>: attribute "parentframe" belongs to poses and forces', schema_sees=False),
    _in_robot('parent frame in tf', '<topic name="a" type="tool_center_frame" parentframe="base" '
              'msg="tf2_msgs/TFMessage"/>',
              '3: <topic>: attribute "parentframe" belongs to poses and forces', schema_sees=False),
    _in_robot('latency of a topic that is only recorded', '<topic name="a" latency="0.1"/>',
              '3: <topic>: attribute "latency" belongs to topics with one of the types '
              '"joint_states", "tool_center_frame", "force_sensor"; remove it',
              schema_sees=False),
    _in_robot('latency with which no stamp counts', '<topic name="a" type="joint_states" '
              'latency="0.6"/>', '3: <topic>: a latency of 0.6 s is too long; give at most 0.5 s',
              schema_sees=False),
    _in_robot('noise', '<topic name="a" type="pointcloud"/><objects noise="kinectt"/>',
              '3: <objects>: attribute "noise": "kinectt" is not the noise of a sensor; write '
              'kinect, realsense, tof or a number greater than 0', kind='depth_sensor'),
    _in_robot('size', '<topic name="a" type="pointcloud"/><roi size="1 0 1"/>',
              '3: <roi>: attribute "size": "1 0 1": each edge length', kind='depth_sensor'),
    _in_robot('environment variable', _NODE + '><env name="A B" value=""/></node>',
              '3: <env>: attribute "name": "A B" is not a valid name'),
    _in_robot('huge attribute', '<base frame="' + 'x ' * 30_000 + '"/>',
              '3: <base>: attribute "frame": "x x x '),
    _in_robot('attribute beyond the limit', '<node pkg="p" type="t" name="n" args="'
              + 'x' * 70_000 + '"/>',
              '3: <node>: attribute "args": "xxxx', schema_sees=False),
]

SUBSTITUTIONS: List[Bad] = [
    _in_robot(f'substitution {written}', f'<topic name="{written}"/>',
              f'3: <topic>: attribute "name": {message}', schema_sees=False)
    for written, message in (
        ('$(find qqxyzzy)', '"$(find qqxyzzy)": there is no package "qqxyzzy"; install it or '
                            'source the workspace that has it'),
        ('$(find roslaunhc)', '"$(find roslaunhc)": there is no package "roslaunhc"; did you mean '
                              '"roslaunch"?'),
        ('$(find)', '"$(find)": $(find pkg) command only accepts one argument'),
        ('$(fnid x)', '"$(fnid …)" cannot be used here; did you mean "find"?'),
        ('$(eval 1+1)', '"$(eval …)" cannot be used here; expected one of: arg'),
        ('$(anon x)', '"$(anon …)" cannot be used here'),
        ('$()', '"$( …)" cannot be used here'),
        ('$( )', '"$( …)" cannot be used here'),
        ('$(arg x)', '"$(arg x)": there is no argument "x"; no <arg> is declared'),
        ('$(arg)', '"$(arg)": $(arg var) must specify a variable name'),
        ('$(env CELL_NOT_SET)', '"$(env CELL_NOT_SET)": environment variable \'CELL_NOT_SET\' is '
                                'not set'),
        ('$(find x', '"$(find x": the ")" that ends "$(" is missing'),
        ('$(env $(arg x))', '"$(env $(arg x))": "$(" cannot be nested in "$("'),
        ('$(optenv A $(arg x))', '"$(optenv A $(arg x))": "$(" cannot be nested in "$("'))
]

COMBINATIONS: List[Bad] = [
    _in_robot('single element twice', '<base frame="a"/>\n<base frame="b"/>',
              '4: <base>: occurs more than once in <device>; keep one'),
    _in_robot('rpy and ypr', '<base frame="a" rpy="0 0 0" ypr="0 0 0"/>',
              '3: <base>: has both "rpy" and "ypr"; keep one', schema_sees=False),
    _in_robot('force without pose', '<force parentframe="a" frame="b"/>',
              '3: <force>: the attribute "xyz" is missing',
              '3: <force>: the attribute "rpy" or "ypr" is missing'),
    _in_robot('force in itself', '<force parentframe="/a" frame="a" xyz="0 0 0" rpy="0 0 0"/>',
              '3: <force>: the frame "a" is its own parent', schema_sees=False),
    _in_robot('children where none belong', '<base frame="a"><topic name="b"/></base>',
              '3: <topic>: <base> cannot contain elements; remove it'),
    _in_robot('unknown attribute', '<base frame="a" xzy="0 0 0"/>',
              '3: <base>: unknown attribute "xzy"; did you mean "xyz"?'),
    _in_robot('topic twice', '<topic name="a"/>\n<topic ns="/" name="a"/>',
              '4: <topic>: the topic "/a" already exists (cell.xml:3)', schema_sees=False),
    _in_robot('topic that is an output',
              '<topic ns="d" name="joint_states" type="joint_states"/>',
              '3: <topic>: "/d/joint_states" is published by the program itself for the device '
              '"d"; '
              'name the topic of its driver', schema_sees=False),
    _in_robot('cloud that is an output', '<topic ns="d" name="points" type="pointcloud"/>',
              '3: <topic>: "/d/points" is published by the program itself for the device "d"',
              schema_sees=False, kind='depth_sensor'),
    _in_robot('joints without names twice',
              '<topic name="a" type="joint_states" msg="std_msgs/Float32MultiArray"/>\n'
              '<topic name="b" type="joint_states"/>',
              '4: <topic>: a topic of type "joint_states" already exists', schema_sees=False),
    _in_robot('function of another device', '<topic name="a" type="pointcloud"/>',
              '3: <topic>: type "pointcloud" belongs to devices of type "depth_sensor"',
              schema_sees=False),
    _in_robot('message of another function',
              '<topic name="a" type="joint_states" msg="sensor_msgs/JoinState"/>',
              '3: <topic>: "sensor_msgs/JoinState" cannot be read as joint_states; did you mean '
              '"sensor_msgs/JointState"?', schema_sees=False),
    _in_robot('node twice', f'{_NODE}/>\n{_NODE}ifstate="realtime"/>',
              '4: <node>: a node named "/d/n" already exists (cell.xml:3)', schema_sees=False),
    _in_robot('node of the program', '<node pkg="p" type="t" name="robot_proc"/>\n'
                                     '<node pkg="p" type="t" name="cell_frames" ns="/"/>',
              '3: <node>: the name "/d/robot_proc" is used by the program itself',
              '4: <node>: the name "/cell_frames" is used by the program itself',
              schema_sees=False),
    _in_robot('respawn and required', _NODE + 'respawn="true" required="true"/>',
              '3: <node>: "respawn" and "required" cannot both be True', schema_sees=False),
    _in_robot('longest length', '<arrow quantity="force" max="0"/>',
              '3: <arrow>: attribute "max": "0" must be greater than 0'),
    _in_robot('arrow twice', '<arrow quantity="force"/>\n<arrow quantity="force"/>',
              '4: <arrow>: an arrow for "force" already exists', schema_sees=False),
    _in_robot('tool twice', '<tool frame="a"/>\n<tool frame="b"/>',
              '4: <tool>: '),
    _in_robot('arrow limits', '<arrow quantity="force" min="2" max="1"/>',
              '3: <arrow>: min (2.0) is greater than max (1.0)', schema_sees=False),
    _in_robot('tolerances of an arrow', '<arrow quantity="force" tolerance="2" max_tolerance="1"/>',
              '3: <arrow>: tolerance (2.0) is greater than max_tolerance (1.0)', schema_sees=False),
    _in_robot('tolerances', '<variable topic="t" frame="f" tolerance="2" max_tolerance="1"/>',
              '3: <variable>: tolerance (2.0) is greater than max_tolerance (1.0)',
              schema_sees=False),
    _in_robot('arrow and force of no robot', '<arrow quantity="force"/>\n<force parentframe="a" '
                                             'frame="b" xyz="0 0 0" rpy="0 0 0"/>',
              '3: <arrow>: belongs to robots only; this device has the type "other"',
              '4: <force>: belongs to robots only', kind='other', schema_sees=False),
    _in_robot('region of no depth sensor', '<roi size="1 1 1"/>',
              '3: <roi>: belongs to depth sensors only', schema_sees=False),
    _in_robot('region without a cloud', '<roi size="1 1 1"/>',
              '3: <roi>: there is no cloud to crop', kind='depth_sensor', schema_sees=False),
    _in_robot('objects of no depth sensor', '<objects topic="a"/>',
              '3: <objects>: belongs to depth sensors only', schema_sees=False),
    _in_robot('objects without a cloud', '<objects/>', '3: <objects>: there is no cloud to look at',
              kind='depth_sensor', schema_sees=False),
    _in_robot('objects that stop before they warn', '<objects topic="a" warn="0.1" stop="0.2"/>',
              '3: <objects>: stop (0.2) is greater than warn (0.1)', kind='depth_sensor',
              schema_sees=False),
    _in_robot('expected without a size', '<objects topic="a"><expected/></objects>',
              '3: <expected>: the attribute "size" is missing', kind='depth_sensor'),
    _in_robot('crop of incomplete images', '<topic name="i" type="camera_info"/>\n'
              '<topic name="d" type="depth_image"/><roi size="1 1 1"/>',
              '3: <topic>: a cloud is made from images only with a <roi> and with topics of all '
              'three types "depth_image", "color_image", "camera_info"',
              '4: <roi>: there is no cloud to crop', '4: <topic>: a cloud is made from images',
              kind='depth_sensor', schema_sees=False),
    _in_robot('images without a crop', '<topic name="i" type="color_image"/>',
              '3: <topic>: a cloud is made from images only with a <roi>', kind='depth_sensor',
              schema_sees=False),
    _in_robot('fusion of no depth sensor', '<fusion sensors="a"/>',
              '3: <fusion>: belongs to depth sensors only',
              '3: <fusion>: there is no depth sensor "a" with a cloud; describe the sensors as '
              'devices', schema_sees=False),
    _in_robot('fusion with a cloud of its own', '<topic name="a" type="pointcloud"/>'
              '<fusion sensors="arm"/>', '3: <fusion>: the device has a cloud of its own',
              '3: <fusion>: there is no depth sensor "arm"', kind='depth_sensor',
              schema_sees=False),
    _in_robot('fusion of nobody', '<fusion sensors=" "/>',
              '3: <fusion>: attribute "sensors": " " is not a list of names',
              kind='depth_sensor'),
    _in_robot('fusion of one sensor twice', '<fusion sensors="a b a"/>',
              '3: <fusion>: attribute "sensors": "a b a" has a name twice',
              kind='depth_sensor', schema_sees=False),
    _in_robot('voxels of no size', '<fusion sensors="a" voxel="0"/>',
              '3: <fusion>: attribute "voxel": "0" must be greater than 0',
              '3: <fusion>: there is no depth sensor "a" with a cloud', kind='depth_sensor'),
    _in_robot('image of a robot', '<topic name="i" type="color_image"/>',
              '3: <topic>: type "color_image" belongs to devices of type "depth_sensor"',
              schema_sees=False),
    _in_robot('display that shows no topic', '<rviz type="Grid" topic="a"/>',
              '3: <rviz>: a display of type "Grid" shows no topic', schema_sees=False),
    _in_robot('display in a display', '<rviz type="TF"><rviz type="Grid"/></rviz>',
              '3: <rviz>: a display of type "TF" cannot hold others', schema_sees=False),
    _in_robot('empty property', '<rviz type="TF">\n<property name="a"/></rviz>',
              '4: <property>: has neither a value nor properties', schema_sees=False),
    _in_robot('property twice', '<rviz type="TF"><property name="a" value="1"/>\n'
                                '<property name="a" value="2"/></rviz>',
              '4: <property>: the property "a" is given twice', schema_sees=False),
    _in_robot('parameter without value', '<param name="a"/>',
              '3: <param>: the attribute "value" or "textfile" or "binfile" or "command" is '
              'missing', schema_sees=False),
    _in_robot('parameter with two values', '<param name="a" value="1" textfile="b"/>',
              '3: <param>: has both "value" and "textfile"', schema_sees=False),
    _in_robot('value of another type', '<param name="a" type="int" value="1.5"/>\n'
                                       '<param name="b" type="bool" value="no"/>\n'
                                       '<param name="c" type="yaml" value="[1"/>',
              '3: <param>: "1.5" is not a whole number', '4: <param>: "no" is not True or False',
              '5: <param>: not valid YAML', schema_sees=False),
    _in_robot('broken YAML', '<rosparam>a: [1,</rosparam>', '3: <rosparam>: not valid YAML',
              schema_sees=False),
    _in_robot('deep YAML', f'<rosparam>a: {"[" * 1000}</rosparam>',
              '3: <rosparam>: not valid YAML: it is nested too deeply', schema_sees=False),
    _in_robot('YAML without a name', _NODE + '>\n<rosparam>[1, 2]</rosparam></node>',
              '4: <rosparam>: the YAML is a single value', schema_sees=False),
    _in_robot('rosparam commands', '<rosparam command="dump"/>\n'
                                   '<rosparam command="delete" file="a"/>',
              '3: <rosparam>: the attribute "file" is missing',
              '4: <rosparam>: delete needs no file', schema_sees=False),
    _in_robot('argument passed on without value', '<launch pkg="p" type="a.launch">\n'
                                                  '<arg name="x"/></launch>',
              '4: <arg>: the attribute "value" is missing'),
    _file('event without a threshold', '<visualizer>\n<event name="a" topic="b"/></visualizer>',
          '2: <event>: the attribute "above" or "below" is missing',
          '2: <event>: the topic "b" is not recorded', schema_sees=False),
    _file('event with two thresholds, and no topic',
          '<visualizer>\n<event name="a" above="1" below="2"/></visualizer>',
          '2: <event>: the attribute "topic" is missing',
          '2: <event>: has both "above" and "below"'),
    _in_robot('event of a topic that is not recorded, and twice',
              '</device>\n<event name="a" topic="x" above="1"/>\n'
              '<event name="a" topic="x" below="1"/><device type="other" name="other">',
              '4: <event>: the topic "x" is not recorded; add it to its device with <topic>',
              '5: <event>: an event named "a" already exists',
              '5: <event>: the topic "x" is not recorded', schema_sees=False),
    _in_robot('misspelt event of the run, and two runs',
              '<topic name="x"/></device>\n<event name="begins" topic="x" above="1"/>\n'
              '<run begin="begin" end="begins"/>\n<run begin="begins" end="a mark"/>'
              '<device type="other" name="other">',
              '5: <run>: attribute "begin": there is no event "begin"; did you mean "begins"?',
              '6: <run>: occurs more than once', schema_sees=False),
    _in_robot('argument passed on twice', '<launch pkg="p" type="a.launch"><arg name="x" value="1"'
                                          '/>\n<arg name="x" value="2"/></launch>',
              '4: <arg>: "x" is given twice', schema_sees=False),
]

BAD_INPUT = WHOLE_FILES + VALUES + SUBSTITUTIONS + COMBINATIONS
