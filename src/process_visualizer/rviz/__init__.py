# SPDX-License-Identifier: BSD-3-Clause
"""What RViz shows: camera, displays, the operator's saved views (pure)."""
