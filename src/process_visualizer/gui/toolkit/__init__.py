"""Looks, icons, tasks and dialogs, which know nothing of cells or recordings."""
