# SPDX-License-Identifier: BSD-3-Clause
"""Makes the cell's meshes: surfaces from outlines, assembled to machines, written as Collada."""
