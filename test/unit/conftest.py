# SPDX-License-Identifier: BSD-3-Clause
"""Lets the tests run from the source tree, with the generated messages of the workspace."""
import os
import sys
from pathlib import Path
from pkgutil import extend_path

from hypothesis import HealthCheck, settings

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / 'src'))

import process_visualizer  # noqa: E402

process_visualizer.__path__ = extend_path(process_visualizer.__path__, 'process_visualizer')

# How long an example takes, or is made, proves nothing. In CI, where a run judges a commit, the
# examples are the same each time; new ones are looked for in everybody's own runs.
settings.register_profile('any machine', deadline=None,
                          suppress_health_check=[HealthCheck.too_slow],
                          derandomize=bool(os.environ.get('CI')))
settings.load_profile('any machine')
