# SPDX-License-Identifier: BSD-3-Clause
"""Sets the current view of an .rviz file: FILE DISTANCE PITCH YAW X Y Z (m and rad, orbit)."""
from __future__ import annotations

import sys
from pathlib import Path

import yaml


def main() -> None:
    """Change the file in place."""
    path = Path(sys.argv[1])
    distance, pitch, yaw, x, y, z = map(float, sys.argv[2:8])
    config = yaml.safe_load(path.read_text())
    config['Visualization Manager']['Views']['Current'].update({
        'Distance': distance, 'Pitch': pitch, 'Yaw': yaw,
        'Focal Point': {'X': x, 'Y': y, 'Z': z}})
    path.write_text(yaml.safe_dump(config, sort_keys=False))


if __name__ == '__main__':
    main()
