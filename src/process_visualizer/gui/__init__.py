# SPDX-License-Identifier: BSD-3-Clause
"""The launcher: the operator's window (PyQt5). See docs/architecture.md for models and views."""
