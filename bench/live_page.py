# SPDX-License-Identifier: BSD-3-Clause
"""Cost of a page of ``cell serve``, and the delay with which it shows a joint.

    bench/run live_page               # the simulated sewing cell: rates, processor, a stuck viewer
    bench/run live_page joint         # from a joint's message to the picture in Chromium
    bench/run live_page link          # on thin links, and cut for 10 s (needs root)
    bench/run live_page soak          # 30 minutes: does anything grow?
    bench/run live_page rosbridge PROGRAM   # rosbridge_websocket with the same cell (needs root)

Rates are payloads with the headers of WebSocket, TCP and IP (two segments each way per message);
the processor's share is that of the process ``cell serve``.
"""
from __future__ import annotations

import asyncio
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any, List, Tuple

import numpy as np
from roslib.packages import find_node
from tornado.httpclient import HTTPRequest
from tornado.websocket import WebSocketClosedError, websocket_connect

REPOSITORY = Path(__file__).resolve().parents[1]
CELL = find_node('process_visualizer', 'cell')[0]
PORT = 11480
MEASURED_S, START_S = 30.0, 25.0
SEGMENT_BYTES = 52
COUNTS = (1, 10)
_TICKS_PER_S = os.sysconf('SC_CLK_TCK')

RAMP_M_S = 0.05
MODEL = '''<robot name="slide"><link name="slide/rail"/><link name="slide/head"><visual><geometry>
<box size="0.3 0.3 0.3"/></geometry></visual></link>
<joint name="x" type="prismatic"><parent link="slide/rail"/><child link="slide/head"/>
<axis xyz="1 0 0"/><limit lower="-99" upper="99" effort="1" velocity="1"/></joint></robot>'''
SLIDE = '''<visualizer><device type="robot" name="slide"><model path="slide.urdf"/>
<base frame="slide/rail" xyz="0 0 0"/><tool frame="slide/head"/>
<topic name="q" type="joint_states" msg="sensor_msgs/JointState"/></device></visualizer>'''


def main() -> int:
    """Print the figures."""
    words = sys.argv[1:]
    if words[:1] == ['publish']:
        publish()
    elif words[:1] == ['watch']:
        asyncio.run(watch(words[1]))
    elif words[:1] == ['browse']:
        browse(words[1])
    elif words[:1] == ['listen']:
        asyncio.run(listen(words[1], int(words[2])))
    else:
        print(f'load {os.getloadavg()[0]:.1f} at the beginning, {os.cpu_count()} cores')
        if words[:1] == ['rosbridge']:
            rosbridge(words[1])
        else:
            {'joint': joint, 'link': link, 'soak': soak}.get(' '.join(words), costs)()
        print(f'load {os.getloadavg()[0]:.1f} at the end')
    return 0


class Processes:
    """The running cell and its page at the address ``url``."""

    def __init__(self, config: str, *options: str, prefix: Tuple[str, ...] = ()) -> None:
        self._all: List['subprocess.Popen[bytes]'] = []
        self.start(*prefix, CELL, 'run', config, '--no-rviz')
        time.sleep(START_S)
        self.serve = subprocess.Popen(
            [*prefix, CELL, 'serve', config, '--port', str(PORT), *options],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self._all.append(self.serve)
        assert self.serve.stdout is not None
        self.url = self.serve.stdout.readline().decode().strip()
        threading.Thread(target=self.serve.stdout.read, daemon=True).start()

    def start(self, *command: str) -> 'subprocess.Popen[bytes]':
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self._all.append(process)
        return process

    def end(self) -> None:
        for process in reversed(self._all):
            process.terminate()
            process.wait()

    @property
    def cpu_s(self) -> float:
        """Return the processor time of the page so far."""
        return processor_s(self.serve)

    @property
    def memory_mb(self) -> float:
        """Return the resident memory of the page."""
        pages = int(Path(f'/proc/{self.serve.pid}/statm').read_text().split()[1])
        return pages * os.sysconf('SC_PAGE_SIZE') / 1e6


def processor_s(process: 'subprocess.Popen[bytes]') -> float:
    """Return the processor time of a process so far."""
    fields = Path(f'/proc/{process.pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS_PER_S


def costs() -> None:
    """Measure the simulated cell with none, one and ten viewers, and one that does not read."""
    cell = Processes(str(REPOSITORY / 'sewing_cell/devices/simulated.xml'))
    try:
        time.sleep(5.0)
        begin_s, cpu_s = time.monotonic(), cell.cpu_s
        time.sleep(MEASURED_S)
        print(f'nobody looks: {100 * (cell.cpu_s - cpu_s) / (time.monotonic() - begin_s):.1f} % '
              f'of a core, {cell.memory_mb:.0f} MB')
        for count in COUNTS:
            print(asyncio.run(watched(cell, count, is_with_stuck=False)))
        print(asyncio.run(watched(cell, COUNTS[-1], is_with_stuck=True)))
    finally:
        cell.end()


async def watched(cell: Processes, count: int, is_with_stuck: bool) -> str:
    """Connect viewers for some time; return the figures as a line."""
    stuck = stuck_viewer() if is_with_stuck else None
    viewers = [await _viewer() for _ in range(count)]
    tasks = [asyncio.ensure_future(received(it)) for it in viewers]
    begin_s, cpu_s = time.monotonic(), cell.cpu_s
    await asyncio.sleep(MEASURED_S)
    passed_s, cpu_s = time.monotonic() - begin_s, cell.cpu_s - cpu_s
    for it in viewers:
        it.close()
    rows = await asyncio.gather(*tasks)
    if stuck is not None:
        stuck.close()
    rates = [8e-3 * size / passed_s for size, _, _ in rows]
    ages_ms = 1e3 * np.concatenate([ages for _, ages, _ in rows])
    lanes = np.mean([8e-3 * it / passed_s for _, _, it in rows])
    return (f'{count} viewers{" beside one that does not read" if is_with_stuck else ""}: '
            f'{np.mean(rates):.0f} kbit/s each (curves {lanes:.0f}), '
            f'{np.mean([len(ages) for _, ages, _ in rows]) / passed_s:.1f} frames/s, '
            f'age p50 {np.percentile(ages_ms, 50):.0f} ms, p95 {np.percentile(ages_ms, 95):.0f} '
            f'ms; {100 * cpu_s / passed_s:.1f} % of a core, {cell.memory_mb:.0f} MB')


async def _viewer() -> Any:
    return await websocket_connect(HTTPRequest(
        f'ws://127.0.0.1:{PORT}/live', headers={'Origin': f'http://127.0.0.1:{PORT}'}))


async def received(viewer: Any, from_s: float = 0.0) -> Tuple[int, List[float], int]:
    """Return the number of bytes received, the age of each frame, and the bytes of curves.

    Data before ``from_s`` does not count.
    """
    count = size = lanes = 0
    ages: List[float] = []
    while True:
        message = await viewer.read_message()
        count += 1
        try:
            await viewer.write_message(str(count))
        except WebSocketClosedError:
            return size, ages, lanes
        if time.monotonic() < from_s:
            continue
        length = len(message) + 4 + SEGMENT_BYTES
        size += length + SEGMENT_BYTES  # a TCP acknowledgment is sent with an answer
        if isinstance(message, bytes) and message[0] == 1:
            ages.append(time.time() - float(np.frombuffer(message, '<f8', 1, 8)[0]))
        elif isinstance(message, bytes):
            lanes += length


def stuck_viewer() -> socket.socket:
    """A viewer that never reads."""
    connection = socket.create_connection(('127.0.0.1', PORT))
    connection.sendall(f'GET /live HTTP/1.1\r\nHost: 127.0.0.1:{PORT}\r\nOrigin: '
                       f'http://127.0.0.1:{PORT}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n'
                       'Sec-WebSocket-Version: 13\r\n'
                       'Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n'.encode())
    return connection


SOAK_MINUTES = 30


def soak() -> None:
    """Keep one viewer for half an hour, while another one connects once a minute."""
    folder = Path(tempfile.mkdtemp())
    (folder / 'slide.urdf').write_text(MODEL)
    (folder / 'cell.xml').write_text(SLIDE)
    cell = Processes(str(folder / 'cell.xml'))
    cell.start(sys.executable, __file__, 'publish')
    driver = chromium((1280, 720))
    try:
        driver.get(f'http://127.0.0.1:{PORT}/')
        print('minute, memory of cell serve [MB], its threads and files, heap of the page [MB]')
        for minute in range(SOAK_MINUTES + 1):
            process = Path(f'/proc/{cell.serve.pid}')
            heap = driver.execute_script('return performance.memory.usedJSHeapSize')
            print(f'{minute:2} {cell.memory_mb:6.1f} {len(list((process / "task").iterdir())):3} '
                  f'{len(list((process / "fd").iterdir())):3} {heap / 1e6:6.1f}', flush=True)
            if minute < SOAK_MINUTES:
                asyncio.run(watched(cell, 1, is_with_stuck=False))
                time.sleep(60.0 - MEASURED_S)
    finally:
        driver.quit()
        cell.end()


BRIDGE_PORT = 9091


def rosbridge(program: str) -> None:
    """Measure rosbridge_websocket with a page's topics: transforms, and markers of the arrows."""
    sys.path.insert(0, str(REPOSITORY / 'test'))
    from two_networks import CELL as CELL_ADDRESS
    from two_networks import TwoNetworks
    networks = TwoNetworks()
    prefix = tuple(networks.command(networks.cell))
    cell = Processes(str(REPOSITORY / 'sewing_cell/devices/simulated.xml'), '--address',
                     CELL_ADDRESS, prefix=prefix)
    bridge = cell.start(*prefix, program, '--port', str(BRIDGE_PORT))
    time.sleep(START_S)
    try:
        networks.bytes_s, networks.delay_s = LINKS[-1][1:]
        for count in COUNTS:
            for name, process, command in (
                    ('cell serve', cell.serve, ('watch', cell.url)),
                    ('rosbridge', bridge, ('listen', CELL_ADDRESS, '1'))):
                begin_s, cpu_s = time.monotonic(), processor_s(process)
                viewers = [subprocess.Popen(
                    networks.command(networks.viewer, sys.executable, __file__, *command),
                    stdout=subprocess.PIPE, text=True) for _ in range(count)]
                said = [it.communicate()[0].strip() for it in viewers]
                share = (processor_s(process) - cpu_s) / (time.monotonic() - begin_s)
                print(f'{name}, {count} viewers: {said[0]}; {100 * share:.1f} % of a core',
                      flush=True)
        networks.bytes_s, networks.delay_s = LINKS[0][1:]
        for name, command in (('cell serve', ('watch', cell.url)),
                              ('rosbridge', ('listen', CELL_ADDRESS, '1'))):
            print(f'{name}, {LINKS[0][0]}: ' + subprocess.run(
                networks.command(networks.viewer, sys.executable, __file__, *command),
                stdout=subprocess.PIPE, text=True, check=True).stdout.strip(), flush=True)
    finally:
        cell.end()
        networks.close()


async def listen(address: str, queue: int) -> None:
    """Be a viewer of rosbridge for some time; print the data received and the age of transforms."""
    viewer = await websocket_connect(f'ws://{address}:{BRIDGE_PORT}')
    devices = ('ur_rt_upper', 'ur_rt_lower', 'sewing_machine')
    for topic in ('/tf', '/tf_static', *(f'/{it}/marker_array' for it in devices)):
        await viewer.write_message(json.dumps({'op': 'subscribe', 'topic': topic,
                                               'queue_length': queue}))
    begin_s, size, ages = time.monotonic() + _SETTLING_S, 0, []
    while time.monotonic() < begin_s + MEASURED_S:
        text = await viewer.read_message()
        if time.monotonic() < begin_s:
            continue
        size += len(text) + 4 + SEGMENT_BYTES
        message = json.loads(text)
        if message.get('topic') == '/tf':
            stamp = message['msg']['transforms'][0]['header']['stamp']
            ages.append(time.time() - stamp['secs'] - 1e-9 * stamp['nsecs'])
    print(f'{8e-3 * size / MEASURED_S:.0f} kbit/s, {len(ages) / MEASURED_S:.1f} transforms/s, age '
          f'p50 {1e3 * np.percentile(ages, 50):.0f} ms, p95 {1e3 * np.percentile(ages, 95):.0f} '
          f'ms, longest {1e3 * max(ages):.0f} ms')


LINKS = (('1 Mbit/s, 100 ms each way', 125e3, 0.1), ('300 kbit/s, 100 ms each way', 37.5e3, 0.1),
         ('100 Mbit/s, 1 ms', 12.5e6, 0.001))
_SETTLING_S, _CUT_S = 10.0, 10.0


def link() -> None:
    """A viewer in another network namespace."""
    sys.path.insert(0, str(REPOSITORY / 'test'))
    from two_networks import CELL as CELL_ADDRESS
    from two_networks import TwoNetworks, problem
    if problem():
        print(f'not measured: {problem()}')
        return
    networks = TwoNetworks()
    cell = Processes(str(REPOSITORY / 'sewing_cell/devices/simulated.xml'), '--address',
                     CELL_ADDRESS, prefix=tuple(networks.command(networks.cell)))
    try:
        for name, networks.bytes_s, networks.delay_s in LINKS:
            print(f'{name}: ' + subprocess.run(
                networks.command(networks.viewer, sys.executable, __file__, 'watch', cell.url),
                stdout=subprocess.PIPE, text=True, check=True).stdout.strip(), flush=True)
        browser = subprocess.Popen(
            networks.command(networks.viewer, sys.executable, __file__, 'browse', cell.url),
            stdout=subprocess.PIPE, text=True)
        assert browser.stdout is not None
        print(browser.stdout.readline().strip())
        networks.is_cut, cut_s = True, time.time()
        time.sleep(_CUT_S)
        networks.is_cut, mended_s = False, time.time()
        lost_s, back_s, gap_s = (float(it) for it in browser.stdout.readline().split())
        print(f'cut for {_CUT_S:g} s: the page says so after {lost_s - cut_s:.1f} s, and is live '
              f'{back_s - mended_s:.1f} s after the link is back; the longest gap in what it has '
              f'then is {gap_s:.2f} s')
        browser.wait()
    finally:
        cell.end()
        networks.close()


async def watch(url: str) -> None:
    """Be a viewer for some time; print the data received and its age."""
    viewer = await websocket_connect(HTTPRequest(
        url.replace('http', 'ws', 1) + 'live', headers={'Origin': '/'.join(url.split('/')[:3])}))
    rows = asyncio.ensure_future(received(viewer, time.monotonic() + _SETTLING_S))
    await asyncio.sleep(_SETTLING_S + MEASURED_S)
    viewer.close()
    size, ages, _ = await rows
    print(f'{8e-3 * size / MEASURED_S:.0f} kbit/s, {len(ages) / MEASURED_S:.1f} frames/s, age '
          f'p50 {1e3 * np.percentile(ages, 50):.0f} ms, p95 {1e3 * np.percentile(ages, 95):.0f} '
          f'ms, longest {1e3 * max(ages):.0f} ms')


def browse(url: str) -> None:
    """Open Chromium; print when the page says that it is cut off, and that it is connected."""
    driver = chromium((1280, 720))
    try:
        driver.get(url)
        time.sleep(15.0)
        print(f'in Chromium: {driver.execute_script("return document.title")}', flush=True)
        state = 'return document.documentElement.classList.contains("lost")'
        times_s = []
        for is_lost in (True, False):
            while driver.execute_script(state) != is_lost:
                time.sleep(0.02)
            times_s.append(time.time())
        time.sleep(5.0)
        gap_s = driver.execute_script(
            'const [rows] = [...page.tracks.rows.values()]; return Math.max(...rows.times.slice('
            '-600).map((it, row, all) => row === 0 ? 0 : it - all[row - 1]))')
        print(*times_s, gap_s, flush=True)
    finally:
        driver.quit()


def joint() -> None:
    """Measure with a slide that moves evenly: its drawn position gives the time of publication."""
    folder = Path(tempfile.mkdtemp())
    (folder / 'slide.urdf').write_text(MODEL)
    (folder / 'cell.xml').write_text(SLIDE)
    cell = Processes(str(folder / 'cell.xml'))
    cell.start(sys.executable, __file__, 'publish')
    try:
        for size in ((1280, 720), (390, 844)):
            ages_ms = 1e3 * np.array(drawn_ages(size))
            print(f'{size[0]}x{size[1]}: a joint is drawn {np.percentile(ages_ms, 50):.0f} ms '
                  f'(p50), {np.percentile(ages_ms, 95):.0f} ms (p95) after it was published; '
                  f'{len(ages_ms) / MEASURED_S:.0f} pictures/s')
    finally:
        cell.end()


def drawn_ages(size: Tuple[int, int]) -> List[float]:
    """Open the page in Chromium; return the age of the slide's position at the end of each draw."""
    driver = chromium(size)
    try:
        driver.get(f'http://127.0.0.1:{PORT}/')
        deadline_s = time.monotonic() + 60.0
        while not driver.execute_script('return Boolean(globalThis.page?.isPlaced)'):
            assert time.monotonic() < deadline_s, 'the page does not show the slide'
            time.sleep(0.1)
        time.sleep(5.0)
        driver.execute_script(
            'globalThis.seen = []; const draw = page.draw.bind(page);'
            'page.draw = (time) => { draw(time); seen.push(['
            '(performance.timeOrigin + performance.now()) / 1000,'
            'page.scene.parts[0].mesh.matrix.elements[12]]); };')
        time.sleep(MEASURED_S)
        rows = np.array(driver.execute_script('return seen'))
    finally:
        driver.quit()
    place = rows[:, 1]
    is_new = np.concatenate(([True], np.diff(place) != 0.0))
    return [float(now_s - origin_s() - x / RAMP_M_S) for now_s, x in rows[is_new]]


def chromium(size: Tuple[int, int]) -> Any:
    """A browser without a window."""
    from selenium.webdriver import Chrome
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service
    options = Options()
    for flag in ('--headless=new', '--no-sandbox', '--use-angle=swiftshader',
                 '--enable-unsafe-swiftshader', f'--window-size={size[0]},{size[1]}'):
        options.add_argument(flag)
    return Chrome(service=Service('/usr/bin/chromedriver'), options=options)


def origin_s() -> float:
    """Return the time when the slide was at 0: the last full ten minutes [s since the epoch]."""
    return 600.0 * (time.time() // 600.0)


def publish() -> None:
    """Be the driver: 125 messages a second."""
    import rospy
    from sensor_msgs.msg import JointState
    rospy.init_node('driver', anonymous=True, disable_signals=True)
    publisher = rospy.Publisher('/q', JointState, queue_size=10, tcp_nodelay=True)
    while not rospy.is_shutdown():
        message = JointState(name=['x'])
        now_s = time.time()
        message.header.stamp = rospy.Time.from_sec(now_s)
        message.position = [RAMP_M_S * (now_s - origin_s())]
        publisher.publish(message)
        time.sleep(0.008)


if __name__ == '__main__':
    sys.exit(main())
