# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell``: functions of the window for configurations and bags, in a terminal."""
