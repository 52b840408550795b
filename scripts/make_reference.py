#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes devices.xsd and the tables of docs/configuration.md from the configuration language."""
from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / 'src'))

from process_visualizer.cell.reference_and_schema import (  # noqa: E402
    schema_text,
    updated_reference,
)


def main() -> None:
    (ROOT / 'devices.xsd').write_text(schema_text(), encoding='utf-8')
    reference = ROOT / 'docs' / 'configuration.md'
    text = reference.read_text(encoding='utf-8')
    reference.write_text(updated_reference(text), encoding='utf-8')


if __name__ == '__main__':
    main()
