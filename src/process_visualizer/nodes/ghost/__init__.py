# SPDX-License-Identifier: BSD-3-Clause
"""The node ghost: the robots of another run beside those of the cell."""
