# SPDX-License-Identifier: BSD-3-Clause
"""Obstacles for people who use a page by keyboard or screen reader, as found by axe."""
from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any, List, Optional


def axe_script() -> Optional[str]:
    """Return the checks; None if the package is not installed (it needs Python 3.10)."""
    found = importlib.util.find_spec('axe_core_python')
    if found is None or found.origin is None:
        return None
    return Path(found.origin).with_name('axe.min.js').read_text(encoding='utf-8')


def faults(driver: Any, script: str) -> List[str]:
    """Return the faults of a browser's page, which must permit foreign scripts."""
    driver.set_script_timeout(120)
    driver.execute_script(script)
    found = driver.execute_async_script(
        'axe.run(document, {resultTypes: ["violations"]}).then(arguments[0])')
    return [f'{it["impact"]}: {it["help"]}: {it["nodes"][0]["html"]}'
            for it in found['violations']]
