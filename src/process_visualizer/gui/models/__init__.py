# SPDX-License-Identifier: BSD-3-Clause
"""What the window knows and can do: QObjects without widgets, whose commands return at once."""
