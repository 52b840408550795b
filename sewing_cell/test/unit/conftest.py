# SPDX-License-Identifier: BSD-3-Clause
"""Lets the tests run from the source tree."""
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "src"))
