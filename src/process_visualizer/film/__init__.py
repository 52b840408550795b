# SPDX-License-Identifier: BSD-3-Clause
"""Films and pictures of runs: their page, drawn frame by frame in a separate browser."""
