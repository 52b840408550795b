# SPDX-License-Identifier: BSD-3-Clause
"""Recordings whose configurations try to run, write, read or connect to something.

Each leaves its name as a file in a folder of canaries if it succeeds.
"""
from __future__ import annotations

import json
from pathlib import Path
from typing import Dict, List, NamedTuple

import rosbag
from genpy import Time
from std_msgs.msg import Float32, String

from process_visualizer.bagio.recorder_topics import CONFIGURATION

ELSEWHERE = '/home/somebody/cells'
_ROBOT = '<robot xmlns:xacro="http://ros.org/wiki/xacro" name="r">{}<link name="base"/>{}</robot>'
_JOINT = '<joint name="j" type="fixed"><parent link="base"/><child link="a"/></joint>'


class Hostile(NamedTuple):
    """A recording: ``inside`` its device, ``before`` it, additional files and arguments.

    ``told`` is part of the message about it.
    """

    name: str
    told: str
    inside: str = ''
    before: str = ''
    files: Dict[str, str] = {}
    arguments: Dict[str, str] = {}


def hostile(canaries: Path, port: int) -> List[Hostile]:
    """Return the recordings; ``port`` is a port of this computer that nothing may connect to."""
    def touch(name: str) -> str:
        return f'touch {canaries}/{name}'

    def python(name: str) -> str:
        return f'__import__(&quot;os&quot;).system(&quot;{touch(name)}&quot;)'

    def model(text: str, name: str = 'arm.xacro') -> Dict[str, str]:
        return {name: text}

    def expression(text: str) -> Dict[str, str]:
        return model(_ROBOT.format(f'<xacro:property name="p" value="${{{text}}}"/>',
                                   '<link name="x${p}"/>'))

    beside = '<base frame="base"/><model path="arm.xacro"/>'
    subclasses = ('vars(type)[&quot;__subclasses__&quot;](type.mro(type(1))[1])')
    frame = ('[g.gi_frame.f_back.f_back.f_builtins for g in [(x for x in [1])]][0]'
             f'[&quot;open&quot;](&quot;{canaries}/generator&quot;, &quot;w&quot;)')
    outside = canaries.parent / 'outside'
    return [
        Hostile('param_command', '"command"',
                f'<param name="a" command="{touch("param_command")}"/>'),
        Hostile('node', 'not trusted', f'<node pkg="rosbag" type="record" name="n" '
                f'args="-O {canaries}/node -a"/>'),
        Hostile('launch_prefix', 'not trusted', '<node pkg="rosout" type="rosout" name="n" '
                f'launch-prefix="{touch("launch_prefix")} ;"/>'),
        Hostile('node_param_command', 'not trusted', '<node pkg="rosout" type="rosout" name="n">'
                f'<param name="a" command="{touch("node_param_command")}"/></node>'),
        Hostile('node_environment', 'not trusted', '<node pkg="rosout" type="rosout" name="n">'
                '<env name="LD_PRELOAD" value="/tmp/evil.so"/><remap from="a" to="b"/></node>'),
        Hostile('launch', 'not trusted', '<launch pkg="process_visualizer" type="gui.launch"/>'),
        Hostile('machine', 'this computer only', before='<machine name="m" address="127.0.0.1" '
                f'ssh-port="{port}" user="u" default="true"/>'),
        Hostile('textfile', '"textfile"', '<param name="a" textfile="/etc/passwd"/>'),
        Hostile('binfile', '"binfile"', '<param name="a" binfile="/etc/passwd"/>'),
        Hostile('rosparam_file', '"file"', '<rosparam file="/etc/hostname" param="a"/>'),
        Hostile('rosparam_dump', '"command"',
                f'<rosparam command="dump" file="{canaries}/dump"/>'),
        Hostile('angle_tag', 'plain values',
                f'<rosparam>a: !radians {python("angle_tag")}</rosparam>'),
        Hostile('angle', 'plain values', '<rosparam>a: rad(&quot;&quot;.join([]) or '
                f'open(&quot;{canaries}/angle&quot;, &quot;w&quot;)</rosparam>'),
        Hostile('param_yaml', 'plain values', '<param name="a" type="yaml" '
                f'value="!radians {python("param_yaml")}"/>'),
        Hostile('subst_value', 'plain values', '<rosparam subst_value="true">a: $(arg x)'
                '</rosparam>', before='<arg name="x" default="1"/>'),
        Hostile('given', 'resolved once more', '<param name="a" value="$(arg x)"/>',
                '<arg name="x" default="1"/>',
                arguments={'x': f'$(eval open("{canaries}/given", "w"))'}),
        Hostile('joined', 'resolved only in files', '<param name="a" value="$(arg x)(eval 1+1)"/>',
                '<arg name="x" default="$"/><arg name="y" default="$(env HOME)"/>'),
        Hostile('environment', '$(env HOME)', '<rviz type="Grid" name="$(env HOME)"/>'),
        Hostile('outer_parameter', 'outside of the namespace',
                '<param name="/use_sim_time" value="true"/>'),
        Hostile('argument_of_name', 'outside of the namespace',
                '<param name="$(arg n)" value="true"/>',
                '<arg name="n" default="/use_sim_time"/>'),
        Hostile('given_name', 'outside of the namespace', '<param name="$(arg n)" value="true"/>',
                '<arg name="n" default="a"/>', arguments={'n': '/use_sim_time'}),
        Hostile('passed_name', 'outside of the namespace', before='<include file="other.xml">'
                '<arg name="n" value="/use_sim_time"/></include>', files={'other.xml': (
                    '<visualizer><arg name="n" default="a"/><device type="other" name="other">'
                    '<param name="$(arg n)" value="true"/><topic name="b"/></device>'
                    '</visualizer>')}),
        Hostile('argument_of_namespace', 'outside of the namespace',
                '<rosparam ns="$(arg n)">use_sim_time: true</rosparam>',
                '<arg name="n" default="/"/>'),
        Hostile('outer_key', 'outside of the namespace',
                '<rosparam>{a: {"\\x2fuse_sim_time": true}}</rosparam>'),
        Hostile('argument_of_type', 'plain values',
                '<param name="a" type="$(arg t)" value="[&amp;a 1, *a]"/>',
                '<arg name="t" default="yaml"/>'),
        Hostile('include', 'neither one of its files', before=f'<include file="{outside}.xml"/>'),
        Hostile('outer_model', 'is not in the recording',
                f'<base frame="base"/><model path="{outside}.urdf"/>'),
        Hostile('climbing_model', 'below the package', '<base frame="base"/>'
                '<model pkg="sewing_cell" path="../../outside.urdf"/>'),
        Hostile('subclasses', 'only calculate', beside, files=expression(
            f'[c for c in {subclasses} if &quot;Popen&quot; in str(c)][0]'
            f'(&quot;{touch("subclasses")}&quot;, shell=True)')),
        Hostile('generator', 'only calculate', beside, files=expression(frame)),
        Hostile('xacro_evaluation', 'only calculate', beside, files=model(_ROBOT.format(
            '<xacro:property name="p" value="$(eval vars)"/>', '<link name="x${p}"/>'))),
        Hostile('xacro_environment', 'HOME', beside, files=model(_ROBOT.format(
            '<xacro:property name="p" value="$(env HOME)"/>', '<link name="x${p}"/>'))),
        Hostile('xacro_include', 'may not read', beside, files=model(_ROBOT.format(
            f'<xacro:include filename="{outside}.urdf"/>', ''))),
        Hostile('xacro_yaml', 'may not read', beside, files=expression(
            f'xacro.load_yaml(&quot;{outside}.yaml&quot;)')),
        Hostile('xacro_memory', 'xacro', beside, files=expression('len(&quot;x&quot;*(10**11))')),
        Hostile('mesh', 'installed packages only', beside, files=model(_ROBOT.format('', ''.join(
            f'<link name="l{number}"><visual><geometry><mesh filename="{uri}"/></geometry></visual>'
            f'</link><joint name="j{number}" type="fixed"><parent link="base"/>'
            f'<child link="l{number}"/></joint>' for number, uri in enumerate((
                f'http://127.0.0.1:{port}/a.dae', f'file://{outside}.dae', '../../a.stl',
                'package://sewing_cell/../../../outside.dae')))))),
        Hostile('hidden_mesh', 'installed packages only', '<base frame="base"/><model '
                'path="arm.urdf"/>', files=model(_ROBOT.format('', '<link name="a"><visual '
                'xmlns="x"><geometry><mesh filename="http://127.0.0.1:'
                f'{port}/a.dae"/></geometry></visual></link>{_JOINT}'), 'arm.urdf')),
        Hostile('zero_mesh', 'installed packages only', beside, files=model(_ROBOT.format(
            '', '<link name="a"><visual><geometry><mesh filename="package://sewing_cell/%00.dae"/>'
            f'</geometry></visual></link>{_JOINT}'))),
        Hostile('xacro_module', 'may not read', beside, files=expression(
            f'xacro.load_yaml(&quot;{outside}.py&quot;)')),
        Hostile('xacro_text', 'more than 10000000 characters', beside, files=expression(
            '&quot;x&quot;*(3*10**7)')),
        Hostile('nested_model', 'more than 100 deep', '<base frame="base"/><model '
                'path="arm.urdf"/>', files=model(_ROBOT.format(
                    '', '<a>' * 10_000 + '</a>' * 10_000), 'arm.urdf')),
        Hostile('many_links', 'more than 1000 links', '<base frame="base"/><model '
                'path="arm.urdf"/>', files=model(_ROBOT.format('', ''.join(
                    f'<link name="l{it}"/>' for it in range(20_000))), 'arm.urdf')),
        Hostile('many_tags', '"textfile"', '<param name="a" textfile="/etc/passwd"/>',
                f'<!-- {"<model " * 150_000} -->', model('<robot name="r"/>', '../arm.urdf')),
        Hostile('entities', 'DOCTYPE', '<base frame="base"/><model path="arm.urdf"/>', files=model(
            '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;">]>' + _ROBOT.format('', ''),
            'arm.urdf')),
        Hostile('python_file', 'holds no', files={'yaml.py': 'import os'}),
        Hostile('hidden_file', 'holds no', files={'.bashrc': touch('hidden_file')}),
    ]


def write_hostile(bag: Hostile, folder: Path) -> str:
    """Write the recording into a folder; return its path."""
    text = ('<visualizer>' + bag.before + '<device type="robot" name="arm">'
            + (bag.inside or '<base frame="base"/>')
            + '<topic name="feed"/></device></visualizer>')
    files = {f'{ELSEWHERE}/cell.xml': text,
             **{f'{ELSEWHERE}/{name}': content for name, content in bag.files.items()}}
    path = folder / f'{bag.name}.bag'
    with rosbag.Bag(str(path), 'w') as file:
        file.write(f'/{CONFIGURATION.strip("/")}', String(json.dumps(
            {'file': f'{ELSEWHERE}/cell.xml', 'files': files, 'arguments': bag.arguments})),
            Time(1_600_000_000))
        for second in range(3):
            file.write('/feed', Float32(second), Time(1_600_000_000 + second))
    return str(path)
