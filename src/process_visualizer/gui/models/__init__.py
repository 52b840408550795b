# SPDX-License-Identifier: BSD-3-Clause
"""Models of the window: QObjects without widgets, whose commands return at once."""
