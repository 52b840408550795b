# SPDX-License-Identifier: BSD-3-Clause
"""Style, icons, tasks and dialogs, which know nothing about cells or recordings."""
