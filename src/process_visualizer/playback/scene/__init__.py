# SPDX-License-Identifier: BSD-3-Clause
"""The scene: all that is visible at a position, and the messages that make it."""
