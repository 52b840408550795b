# SPDX-License-Identifier: BSD-3-Clause
"""Curves while the cell runs, of what its recorder has in memory."""
