# SPDX-License-Identifier: BSD-3-Clause
"""How far a run is from good ones, and when it left them."""
