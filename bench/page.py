# SPDX-License-Identifier: BSD-3-Clause
"""The page of a run: size, loading time and smoothness; and the film made of it.

usage: bench/run page RUN [--reference GOOD …] [--clouds] [--film]

The browser is a Chromium without a window and without a graphics card, 1280x720. Times of the page
itself are measured by its own clock.
"""
from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, List

import numpy as np

from process_visualizer.film.headless_browser import HeadlessBrowser

SIZE = 1280, 720
SEEKS = 40
FILM_HZ, FILM_FRAMES = 25.0, 100

FIRST = '''new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(
  () => done(performance.now()))))'''
PLAY = '''new Promise((done) => {
  const draw = page.draw.bind(page);
  let count = 0;
  page.draw = (time) => { ++count; draw(time); };
  page.transport.seek(page.run.begin);
  page.transport.toggle();
  const begin = performance.now();
  setTimeout(() => { page.transport.pause(); page.draw = draw;
    done(1000 * count / (performance.now() - begin)); }, 5000);
})'''
SEEK = '''new Promise((done) => {
  const begin = performance.now();
  page.transport.seek(%f);
  requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now() - begin)));
})'''


def timed(words: List[str]) -> str:
    """Run a command; return its wall and processor time as text."""
    before, begin_s = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run(words, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = sum(getattr(after, it) - getattr(before, it) for it in ('ru_utime', 'ru_stime'))
    return f'{time.monotonic() - begin_s:.1f} s, {cpu_s:.1f} s of processor time'


def film_parts(page: Path, frames: int) -> str:
    """Return the time to draw, grab and encode a frame of a film, one after the other."""
    drawn, grabbed, pictures = 0.0, 0.0, []
    with HeadlessBrowser(page, SIZE, 'film') as browser:
        begin_s, _ = browser.evaluate('[page.run.begin, page.run.end]')
        browser.evaluate('page.film({dark: false, curves: []})')
        for number in range(frames):
            camera = {'begin': ['cell', begin_s], 'end': ['cell', begin_s], 'share': 1.0}
            start_s = time.monotonic()
            browser.evaluate(f'page.filmFrame(0, {begin_s + number / FILM_HZ}, '
                             f'{json.dumps(list(camera.values()))})')
            middle_s = time.monotonic()
            pictures.append(browser.picture())
            drawn, grabbed = drawn + middle_s - start_s, grabbed + time.monotonic() - middle_s
    start_s = time.monotonic()
    subprocess.run(['ffmpeg', '-y', '-loglevel', 'error', '-f', 'image2pipe', '-framerate',
                    f'{FILM_HZ:g}', '-c:v', 'png', '-i', '-', '-c:v', 'libx264', '-pix_fmt',
                    'yuv420p', '-crf', '18', str(page.with_name('parts.mp4'))],
                   input=b''.join(pictures), check=True)
    encoded = time.monotonic() - start_s
    return 'a frame is drawn in {:.0f} ms, grabbed in {:.0f} ms, encoded in {:.0f} ms'.format(
        *(1000.0 * it / frames for it in (drawn, grabbed, encoded)))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('run')
    parser.add_argument('--reference', nargs='+', default=[])
    parser.add_argument('--clouds', action='store_true')
    parser.add_argument('--film', action='store_true')
    options = parser.parse_args()
    print(f'load {os.getloadavg()[0]:.1f}')
    words = ['rosrun', 'process_visualizer', 'cell', 'share', options.run,
             *(['--reference', *options.reference] if options.reference else []),
             *(['--clouds'] if options.clouds else []), '-o']
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'page.html'
        print('written in', timed([*words, str(path)]))
        print(f'size {path.stat().st_size / 1e6:.2f} MB')
        with HeadlessBrowser(path, SIZE) as browser:
            print(f'first picture in a new browser after {browser.evaluate(FIRST) / 1000:.2f} s')
            again = path.with_name('again.html')
            path.rename(again)  # another address, so that nothing of the first one is cached
            browser.open(again)
            print(f'in a browser that runs after {browser.evaluate(FIRST) / 1000:.2f} s')
            print(f'playing: {browser.evaluate(PLAY):.1f} pictures a second')
            begin_s, end_s = browser.evaluate('[page.run.begin, page.run.end]')
            chance = np.random.default_rng(1)
            seeks: Any = [browser.evaluate(SEEK % at_s)
                          for at_s in chance.uniform(begin_s, end_s, SEEKS)]
            print('seek to picture: median {:.0f} ms, p95 {:.0f} ms'.format(
                *np.percentile(seeks, (50, 95))))
        if options.film:
            print(film_parts(again, FILM_FRAMES))
            words[3] = 'film'
            print('film in', timed([*words, str(Path(folder) / 'film.mp4')]))
    return 0


if __name__ == '__main__':
    sys.exit(main())
