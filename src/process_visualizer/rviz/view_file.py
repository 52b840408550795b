# SPDX-License-Identifier: BSD-3-Clause
"""Reads RViz's files."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Dict

import yaml

from process_visualizer.cell.plain_yaml import plain_yaml


def read_view(path: str) -> Dict[str, Any]:
    """The content of an RViz file.

    Raises:
        OSError: it cannot be read.
        ValueError: it is not a file of RViz.
    """
    try:
        content = plain_yaml(Path(path).read_text(encoding='utf-8'))
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ValueError(f'{path}: not YAML: {" ".join(str(error).split())}') from None
    if not isinstance(content, dict) or not isinstance(content.get('Visualization Manager'), dict):
        raise ValueError(f'{path}: not an RViz configuration: it has no "Visualization Manager"')
    return content
