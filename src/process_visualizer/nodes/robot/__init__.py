# SPDX-License-Identifier: BSD-3-Clause
"""What the robot processor consists of."""
