# SPDX-License-Identifier: BSD-3-Clause
"""Does everything with recordings that a user does, and loads the files generated from them.

usage: hostile_program.py FOLDER BAG…
For each recording it prints a line of JSON: the nodes to be started, and the messages.
"""
from __future__ import annotations

import contextlib
import io
import json
import sys
from pathlib import Path
from typing import Any, Dict, List

from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader

from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Cell, Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.commands.command_line import main
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.generator import generate_parts
from process_visualizer.generate.plan import write_plan
from process_visualizer.runs.recorded.chosen_runs import recorded_cell


def _loaded(cell: Cell, folder: Path, bag: str) -> List[Dict[str, Any]]:
    """The nodes that roslaunch would start, in both modes; it runs the commands in parameters."""
    found: List[Dict[str, Any]] = []
    for mode in Mode:
        plan = generate_parts(Choice(cell, mode, cell.devices,
                                     bag=bag if mode is Mode.PLAYBACK else None))
        for warning in plan.warnings:
            print(warning)
        for path in write_plan(plan, str(folder / mode.value)):
            if path.endswith('.launch'):
                found += _nodes(path)
            if path.endswith('.urdf'):
                print('URDF', Path(path).read_text(encoding='utf-8'))
    return found


def _nodes(path: str) -> List[Dict[str, Any]]:
    config = ROSLaunchConfig()
    loader = XmlLoader(resolve_anon=False)
    loader.ignore_unset_args = False
    loader.load(path, config, argv=[], verbose=False)
    return [{'node': f'{it.package}/{it.type}', 'prefix': it.launch_prefix, 'args': it.args,
             'machine': it.machine_name, 'environment': it.env_args,
             'parameters': {name: str(its.value) for name, its in config.params.items()
                            if not name.endswith('/configuration')}}
            for it in config.nodes]


def _use(bag: str, folder: Path) -> List[Dict[str, Any]]:
    started: List[Dict[str, Any]] = []
    folder.mkdir()
    for words in (['report', bag], ['runs', bag], ['configuration', bag, '--output', str(folder)],
                  ['new', bag, '-o', str(folder / 'new' / 'cell.xml')]):
        (folder / 'new').mkdir(exist_ok=True)
        main(words)
    new = folder / 'new' / 'cell.xml'
    try:
        with Recording([bag]) as recording, recorded_cell(recording) as cell:
            print(*cell.ignored, sep='\n')
            started += _loaded(cell, folder / 'of_bag', bag)
    except Exception as error:  # the message to a user
        print(f'{type(error).__name__}: {error}')
    if new.exists():
        print('NEW', new.read_text(encoding='utf-8'))
        started += _loaded(XmlParser().parse(str(new)), folder / 'of_new', bag)
    return started


def _main(words: List[str]) -> None:
    for number, bag in enumerate(words[1:]):
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            started = _use(bag, Path(words[0]) / str(number))
        print(json.dumps({'name': Path(bag).stem, 'started': started, 'said': said.getvalue()}),
              flush=True)


_main(sys.argv[1:])
