# SPDX-License-Identifier: BSD-3-Clause
"""Playback: the opened recording, commands to the player, and the timeline with its buttons."""
