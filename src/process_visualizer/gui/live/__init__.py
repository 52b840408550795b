# SPDX-License-Identifier: BSD-3-Clause
"""The running cell: its last minutes as curves, and their replay."""
