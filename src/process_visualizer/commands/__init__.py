# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell``: what the window does with configurations and bags, without a window."""
