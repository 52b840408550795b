# SPDX-License-Identifier: BSD-3-Clause
"""Which moment of one run belongs to which moment of another."""
