# SPDX-License-Identifier: BSD-3-Clause
"""Looks, icons, tasks and dialogs, which know nothing of cells or recordings."""
