# SPDX-License-Identifier: BSD-3-Clause
"""The benchmarks are programs: their modules stand in a folder of their own."""
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'bench'))
