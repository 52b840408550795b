# SPDX-License-Identifier: BSD-3-Clause
"""The page of a comparison has pictures of the scene, by an RViz that nobody sees."""
from __future__ import annotations

import re
from base64 import b64decode
from pathlib import Path
from typing import Dict

from cycle_bags import write_bag
from pictures import different_pixels
from running import run_command

PICTURE = re.compile(r'base64,([^"]+)"')
ALL = '800x600+0+0'


def test_good_beside_poor(ros_environment: Dict[str, str], tmp_path: Path) -> None:
    """The force's arrow is longer; all else is where it was."""
    bag, page = write_bag(tmp_path, poor=1), tmp_path / 'page.html'
    hidden = {**ros_environment, 'DISPLAY': ':none'}
    done = run_command(hidden, 'rosrun', 'process_visualizer', 'cell', 'compare', f'{bag}#2',
                       '--reference', f'{bag}#1', '--report', str(page))
    assert done.returncode == 2, done.stdout
    found = [b64decode(it) for it in PICTURE.findall(page.read_text(encoding='utf-8'))]
    assert len(found) == 2, done.stdout
    good, poor = tmp_path / 'good.jpg', tmp_path / 'poor.jpg'
    for path, picture in zip((good, poor), found):
        path.write_bytes(picture)
    assert 100 < different_pixels(good, poor, ALL) < 100_000
