# SPDX-License-Identifier: BSD-3-Clause
"""Messages as bytes: definitions, layout, stamps and parts, without deserialising (pure)."""
