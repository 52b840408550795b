# SPDX-License-Identifier: BSD-3-Clause
"""Playback: models, and the timeline with its buttons."""
