# SPDX-License-Identifier: BSD-3-Clause
"""The node ghost: shows the robots of another run beside those of the cell."""
