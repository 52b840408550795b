# SPDX-License-Identifier: BSD-3-Clause
"""The curves of process variables in lanes, and the choice of curves."""
