# SPDX-License-Identifier: BSD-3-Clause
"""Bag files: index, chunks, connections, repair; what else our recorder writes (pure)."""
