# SPDX-License-Identifier: BSD-3-Clause
"""Playback and what is in a recording."""
