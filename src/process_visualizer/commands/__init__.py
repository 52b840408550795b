# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell``: the window's functions for configurations and bags, in a terminal."""
