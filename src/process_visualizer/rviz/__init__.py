# SPDX-License-Identifier: BSD-3-Clause
"""The contents of RViz: camera, displays, the operator's saved views (pure)."""
