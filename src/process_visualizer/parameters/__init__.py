# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the nodes, written by generation and read by nodes, each in one class (pure)."""
