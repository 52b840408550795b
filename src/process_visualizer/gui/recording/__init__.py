# SPDX-License-Identifier: BSD-3-Clause
"""Recording: the choice of topics and file, commands to the recorder, its state, and the panel."""
