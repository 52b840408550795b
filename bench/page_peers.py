# SPDX-License-Identifier: BSD-3-Clause
"""The page of a run beside meshcat's static page and a Rerun recording of the same models.

    pip install meshcat rerun-sdk mcap-ros1-support     # into an environment of their own
    PYTHON bench/page_peers.py write RUN.mcap FOLDER    # with its Python: the others' files
    bench/run page_peers PAGE.html FOLDER RERUN         # sizes, and time to the first picture

RUN.mcap is that of ``cell export`` without reference, of a recording without frames of its own
(``rosbag filter BAG OUT "m._type != 'tf2_msgs/TFMessage'"``): its models, frames and numbers are
those of the page. The browser is Chromium without a graphics card, 1280x720; the first picture is
the first with at least half of the models' triangles, and its time counts from the start of the
navigation. The processor time of the browser's processes until then depends less on other load.
RERUN is its program, whose server on this computer provides viewer and recording.
"""
from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Tuple
from urllib.parse import quote
from urllib.request import urlopen

import numpy as np

POSES_HZ = 25.0
PAGE, RERUN = 'meshcat.html', 'run.rrd'
SIZE = 1280, 720
TURNS, LONGEST_S = 5, 300
PORT = 21350

WATCH = '''
  globalThis.drawn = 0; globalThis.firstPicture = null;
  const half = %d;
  for (const kind of [WebGL2RenderingContext, WebGLRenderingContext]) {
    const count = (name, number) => {
      const draw = kind.prototype[name];
      if (draw === undefined) return;
      kind.prototype[name] = function(...given) {
        if (given[0] === 4) globalThis.drawn += number(given) / 3;
        return draw.apply(this, given);
      };
    };
    count('drawArrays', (it) => it[2]);
    count('drawElements', (it) => it[1]);
    count('drawRangeElements', (it) => it[3]);
    count('drawArraysInstanced', (it) => it[2] * it[3]);
    count('drawElementsInstanced', (it) => it[1] * it[4]);
  }
  const look = () => {
    if (globalThis.drawn >= half && globalThis.firstPicture === null) {
      requestAnimationFrame(() => { globalThis.firstPicture ??= performance.now(); });
    }
    globalThis.drawn = 0;
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);'''
FIRST = '''new Promise((done) => {
  const ask = () => globalThis.firstPicture === null ? setTimeout(ask, 20)
    : done(globalThis.firstPicture / 1000);
  ask(); })'''


class Part(NamedTuple):
    """The mesh of a link: corners (n, 3), triangles (m, 3), colors (n, 3) 0 to 255."""

    frame: str
    corners: np.ndarray
    triangles: np.ndarray
    colors: np.ndarray


class Contents(NamedTuple):
    """Content of an MCAP file: models, poses by frame (n, 8) with times, numbers by topic (n, 2).

    Times are seconds from the first pose; a pose is x y z [m], x y z w.
    """

    parts: List[Part]
    poses: Dict[str, np.ndarray]
    numbers: Dict[str, np.ndarray]


def read(path: str) -> Contents:
    """Read the models, frames and numbers of ``cell export``."""
    from mcap_ros1.reader import read_ros1_messages
    parts: List[Part] = []
    poses: Dict[str, Any] = {}
    numbers: Dict[str, Any] = {}
    for it in read_ros1_messages(path, topics=None):
        topic, time_s, message = it.topic, it.log_time_ns / 1e9, it.ros_msg
        if topic == '/process_visualizer/models':
            parts = [_part(marker) for marker in message.markers]
        elif topic in ('/tf', '/tf_static'):
            for sent in message.transforms:
                at, turn = sent.transform.translation, sent.transform.rotation
                poses.setdefault(sent.child_frame_id, []).append(
                    (time_s, at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w))
        elif topic.startswith('/process_visualizer/') and \
                isinstance(getattr(message, 'data', None), float):
            numbers.setdefault(topic, []).append((time_s, message.data))
    begin_s = min(rows[0][0] for rows in poses.values())
    return Contents(parts, *({name: np.array(rows) - [begin_s, *[0.0] * (len(rows[0]) - 1)]
                              for name, rows in found.items()} for found in (poses, numbers)))


def _part(marker: Any) -> Part:
    points = np.array([(it.x, it.y, it.z) for it in marker.points], np.float32)
    colors = np.rint(255.0 * np.array([(it.r, it.g, it.b) for it in marker.colors]))
    rows, inverse = np.unique(np.hstack((points, colors.astype(np.float32))), axis=0,
                              return_inverse=True)
    return Part(marker.header.frame_id, rows[:, :3], inverse.reshape(-1, 3).astype(np.uint32),
                rows[:, 3:].astype(np.uint8))


def write(source: str, folder: Path) -> None:
    """Write meshcat's page and Rerun's recording."""
    contents = read(source)
    _write_meshcat(contents, folder / PAGE)
    _write_rerun(contents, folder / RERUN)
    print(sum(len(it.triangles) for it in contents.parts), file=(folder / 'triangles').open('w'))


def _write_meshcat(contents: Contents, path: Path) -> None:
    import meshcat
    from meshcat.animation import Animation
    from meshcat.geometry import MeshPhongMaterial, TriangularMeshGeometry
    viewer = meshcat.Visualizer()
    animation = Animation(default_framerate=POSES_HZ)
    for number, part in enumerate(contents.parts):
        name, rows = str(number), contents.poses[part.frame]
        viewer[name].set_object(TriangularMeshGeometry(
            part.corners, part.triangles, color=part.colors / 255.0),
            MeshPhongMaterial(vertexColors=True))
        viewer[name].set_transform(_matrix(rows[0, 1:]))
        steps = int(rows[-1, 0] * POSES_HZ) + 1 if len(rows) > 1 else 0
        for step in range(steps):
            row = max(int(np.searchsorted(rows[:, 0], step / POSES_HZ + 1e-6)) - 1, 0)
            with animation.at_frame(viewer, step) as shown:
                shown[name].set_transform(_matrix(rows[row, 1:]))
    viewer.set_animation(animation)
    path.write_text(viewer.static_html(), encoding='utf-8')


def _matrix(pose: np.ndarray) -> np.ndarray:
    x, y, z, w = pose[3:]
    matrix = np.eye(4)
    matrix[:3, 3] = pose[:3]
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    return matrix


def _write_rerun(contents: Contents, path: Path) -> None:
    import rerun as rr
    rr.init('run', spawn=False)
    rr.save(path)
    for number, part in enumerate(contents.parts):
        name = f'cell/{number}'
        rr.log(name, rr.Mesh3D(vertex_positions=part.corners, triangle_indices=part.triangles,
                               vertex_colors=part.colors), static=True)
        rows = contents.poses[part.frame]
        rr.send_columns(name, [rr.TimeColumn('time', duration=rows[:, 0])],
                        rr.Transform3D.columns(translation=rows[:, 1:4], quaternion=rows[:, 4:]))
    for topic, rows in contents.numbers.items():
        rr.send_columns(topic, [rr.TimeColumn('time', duration=rows[:, 0])],
                        rr.Scalars.columns(scalars=rows[:, 1]))
    rr.disconnect()


def measure(page: Path, folder: Path, rerun: str) -> None:
    """Print sizes, and the time of each to its first picture, measured in turns."""
    half = int((folder / 'triangles').read_text()) // 2
    files = {'page': page, 'meshcat': folder / PAGE, 'Rerun': folder / RERUN}
    times_s: Dict[str, List[Tuple[float, float]]] = {name: [] for name in files}
    print(f'load {os.getloadavg()[0]:.1f} at the beginning')
    for _ in range(TURNS):
        for name, path in files.items():
            with _address(path, rerun) as address:
                times_s[name].append(first_picture(address, half))
            print('{}: {:.2f} s, {:.2f} s of processor time'.format(name, *times_s[name][-1]),
                  flush=True)
    for name, found in times_s.items():
        wall, spent = ('{1:.1f} s ({0:.1f} to {2:.1f})'.format(*np.percentile(it, (0, 50, 100)))
                       for it in zip(*found))
        print(f'{name}: {files[name].stat().st_size / 1e6:.1f} MB; first picture in a new browser '
              f'after {wall}, {spent} of processor time')
    print(f'load {os.getloadavg()[0]:.1f} at the end')


@contextmanager
def _address(path: Path, rerun: str) -> Iterator[str]:
    """Yield the address of a file for a browser; a recording needs Rerun's server."""
    if path.name != RERUN:
        yield path.absolute().as_uri()
        return
    server = subprocess.Popen([rerun, '--serve-web', '--port', str(PORT), '--web-viewer-port',
                               str(PORT + 1), str(path)],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              start_new_session=True)  # the script starts the program itself
    viewer = f'http://127.0.0.1:{PORT + 1}/'
    try:
        _await(viewer)
        yield f'{viewer}?url={quote(f"rerun+http://127.0.0.1:{PORT}/proxy")}'
    finally:
        os.killpg(server.pid, signal.SIGTERM)
        server.wait()


def _await(address: str) -> None:
    deadline_s = time.monotonic() + 60.0
    while True:
        try:
            with urlopen(address):
                return
        except OSError:
            if time.monotonic() > deadline_s:
                raise
            time.sleep(0.1)


def first_picture(address: str, half: int) -> Tuple[float, float]:
    """Return the time to the first picture in a new browser [s], and its processor time [s]."""
    from live_page import chromium
    driver = chromium(SIZE)
    try:
        driver.set_script_timeout(LONGEST_S)
        driver.execute_cdp_cmd('Page.addScriptToEvaluateOnNewDocument', {'source': WATCH % half})
        driver.get('about:blank')
        before_s = _processor_s(driver.service.process.pid)
        driver.get(address)
        first_s = float(driver.execute_async_script(
            f'const back = arguments[0]; {FIRST}.then(back)'))
        spent_s = _processor_s(driver.service.process.pid) - before_s
        return first_s, spent_s
    finally:
        driver.quit()


def _processor_s(parent: int) -> float:
    """Return the processor time of all processes below one so far."""
    found, ticks = {parent}, 0
    rows = []
    for path in Path('/proc').glob('[0-9]*/stat'):
        with suppress(OSError):
            fields = path.read_text().rpartition(')')[2].split()
            rows.append((int(path.parent.name), int(fields[1]), int(fields[11]) + int(fields[12])))
    for number, above, used in sorted(rows):  # a child has a greater number than its parent
        if above in found:
            found.add(number)
            ticks += used
    return ticks / os.sysconf('SC_CLK_TCK')


if __name__ == '__main__':
    if sys.argv[1] == 'write':
        write(sys.argv[2], Path(sys.argv[3]))
    else:
        measure(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])
