# SPDX-License-Identifier: BSD-3-Clause
"""Films and pictures of runs: their page, drawn moment by moment by a browser of its own."""
