# SPDX-License-Identifier: BSD-3-Clause
"""Playback and its timeline."""
