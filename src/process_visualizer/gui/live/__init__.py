# SPDX-License-Identifier: BSD-3-Clause
"""The running cell: curves of the last minutes, and their replay."""
