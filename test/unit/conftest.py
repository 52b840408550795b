# SPDX-License-Identifier: BSD-3-Clause
"""Lets the tests run from the source tree, with the generated messages of the workspace."""
import sys
from pathlib import Path
from pkgutil import extend_path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / 'src'))

import process_visualizer  # noqa: E402

process_visualizer.__path__ = extend_path(process_visualizer.__path__, 'process_visualizer')
