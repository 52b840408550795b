# SPDX-License-Identifier: BSD-3-Clause
"""Recording: models and the panel."""
