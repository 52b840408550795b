# SPDX-License-Identifier: BSD-3-Clause
"""Evidence of a cell that runs or was recorded: topics, frames, and how they move."""
