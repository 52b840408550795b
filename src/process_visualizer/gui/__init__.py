# SPDX-License-Identifier: BSD-3-Clause
"""The launcher: the operator's window (PyQt5). Models and views apart; see docs/architecture.md."""
