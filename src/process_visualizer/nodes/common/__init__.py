# SPDX-License-Identifier: BSD-3-Clause
"""What several nodes have in common."""
