# SPDX-License-Identifier: BSD-3-Clause
"""Services for other programs: their requests have these fields, in this order."""
from __future__ import annotations

from typing import Any

import pytest

from process_visualizer.srv import Mark, Seek, SetLoop, SetRate, Step


@pytest.mark.parametrize(('service', 'fields'), [
    (Mark, 'string label'), (Seek, 'float64 position'), (SetRate, 'float64 rate'),
    (Step, 'int32 count, string topic, float64 duration'),
    (SetLoop, 'bool loop, float64 begin, float64 end')])
def test_a_request_keeps_its_fields(service: Any, fields: str) -> None:
    request = service._request_class
    assert ', '.join(f'{kind} {name}' for kind, name in zip(
        request._slot_types, request.__slots__)) == fields
    assert set(service._response_class.__slots__) >= {'success', 'message'}
