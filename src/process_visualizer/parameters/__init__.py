# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the nodes: what generation writes and nodes read, each in one class (pure)."""
