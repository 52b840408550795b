# SPDX-License-Identifier: BSD-3-Clause
"""What runs or was recorded: topics, frames, and how they move."""
