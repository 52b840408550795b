# SPDX-License-Identifier: BSD-3-Clause
"""Changes to configuration files that leave everything else as it is."""
