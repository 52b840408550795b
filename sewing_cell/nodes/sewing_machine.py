#!/usr/bin/env python3
"""Shows the sewing machine and its sensors; see sewing_cell.sewing_machine."""
from sewing_cell.sewing_machine import main

main()
