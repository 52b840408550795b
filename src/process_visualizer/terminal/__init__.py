# SPDX-License-Identifier: BSD-3-Clause
"""The command bag_player: options, keys and progress line in a terminal."""
