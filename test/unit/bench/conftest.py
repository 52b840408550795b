# SPDX-License-Identifier: BSD-3-Clause
"""Benchmarks are programs: their modules are in a separate folder."""
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'bench'))
