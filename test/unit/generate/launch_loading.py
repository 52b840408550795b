# SPDX-License-Identifier: BSD-3-Clause
"""Loads launch files with roslaunch's own loader, without a master."""
from __future__ import annotations

from pathlib import Path
from typing import Dict, List

from roslaunch.config import ROSLaunchConfig
from roslaunch.core import Node
from roslaunch.xmlloader import XmlLoader

from process_visualizer.generate.plan import CONFIGURATION_FILE


def load_file(path: Path) -> ROSLaunchConfig:
    """The launch file as roslaunch loads it; fails on any complaint."""
    config = ROSLaunchConfig()
    loader = XmlLoader(resolve_anon=False)
    loader.ignore_unset_args = False
    loader.load(str(path), config, argv=[], verbose=False)
    assert config.config_errors == []
    return config


def load_text(text: str, folder: Path) -> ROSLaunchConfig:
    """The same for the text of a launch file in the folder."""
    path = folder / 'cell.launch'
    path.write_text(text, encoding='utf-8')
    (folder / CONFIGURATION_FILE).write_text('{}')
    return load_file(path)


def nodes(config: ROSLaunchConfig) -> Dict[str, Node]:
    """The nodes by their absolute names."""
    return {node.namespace + node.name: node for node in config.nodes}


def parameters(config: ROSLaunchConfig, prefix: str = '/') -> Dict[str, object]:
    """The parameters below a namespace, by their relative names."""
    return {name[len(prefix):].lstrip('/'): param.value for name, param in config.params.items()
            if name.startswith(prefix)}


def node_names(config: ROSLaunchConfig) -> List[str]:
    """The absolute names of the nodes, sorted."""
    return sorted(nodes(config))
