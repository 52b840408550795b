#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Shows the sewing machine and its sensors; see sewing_cell.sewing_machine."""
from process_visualizer.interrupts import silent_interrupts

with silent_interrupts():
    from sewing_cell.sewing_machine import main

main()
