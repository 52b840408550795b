# SPDX-License-Identifier: BSD-3-Clause
"""The page of ``cell serve`` in a real browser: live, after seeks, cut off, and connected again."""
from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Iterator, List

import pytest
from live_stand import LABEL, LiveStand
from page_faults import axe_script, faults
from selenium.webdriver import Chrome
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

from process_visualizer.msg import DetectedObject, DetectedObjects

WIDE, PHONE = (1920, 1080), (390, 844)
_LIMIT_S = 60
_PLACE = "page.tracks.rows.get('place head')"


class Browser:
    """Chromium with the page of a stand."""

    def __init__(self, stand: LiveStand, size: 'tuple[int, int]' = WIDE) -> None:
        options = Options()
        for flag in ('--headless=new', '--no-sandbox', '--disable-dev-shm-usage',
                     '--use-angle=swiftshader', '--enable-unsafe-swiftshader'):
            options.add_argument(flag)
        options.set_capability('goog:loggingPrefs', {'browser': 'ALL', 'performance': 'ALL'})
        self.driver = Chrome(service=Service('/usr/bin/chromedriver'), options=options)
        self.driver.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', {
            'width': size[0], 'height': size[1], 'deviceScaleFactor': 1, 'mobile': size == PHONE})
        self.driver.get(stand.url)
        self.wait('document.documentElement.dataset.ready === "true"')
        self.wait('page.isPlaced')

    def run(self, script: str) -> Any:
        return self.driver.execute_script(script)

    def wait(self, condition: str) -> None:
        WebDriverWait(self.driver, _LIMIT_S, 0.02).until(
            lambda _: self.run(f'return Boolean({condition})'), condition)

    def press(self, *keys: str) -> None:
        ActionChains(self.driver).send_keys(*keys).perform()

    @property
    def link(self) -> str:
        return str(self.run('return document.getElementById("link").textContent'))

    def texts(self) -> List[str]:
        return list(self.run('return [...document.querySelectorAll("#numbers tr")]'
                             '.filter((it) => !it.hidden).map((it) => it.lastChild.textContent)'))

    def at_one_moment(self) -> 'tuple[float, float, float, str]':
        """Return the shown time, the frame's time, the position of the head, the force's text."""
        time_s, sent_s, place, text = self.run(
            f'const time = page.transport.time; page.draw(time); return [time,'
            f' Math.max(...{_PLACE}.times.filter((it) => it <= time)),'
            ' page.scene.parts[1].mesh.matrix.elements[12],'
            ' document.querySelector("#numbers td").textContent]')
        return time_s, sent_s, place, text


@pytest.fixture
def stand(tmp_path: Path) -> Iterator[LiveStand]:
    found = LiveStand(tmp_path)
    yield found
    found.close()


@pytest.fixture
def browser(stand: LiveStand) -> Iterator[Browser]:
    found = Browser(stand)
    yield found
    found.driver.quit()


def test_it_shows_the_present_and_asks_nobody_else(browser: Browser, stand: LiveStand) -> None:
    browser.wait('page.curves.length > 100')
    begin_s = float(browser.run('return page.transport.time'))
    browser.wait(f'page.transport.time > {begin_s + 1.0}')
    time_s, sent_s, place, text = browser.at_one_moment()
    assert time_s == sent_s
    assert place == pytest.approx(stand.place(time_s), abs=1e-5)
    assert text == f'F {stand.force(time_s):.1f} N'
    assert browser.texts()[1] == f'{LABEL} 402 K'
    assert browser.link == 'Live'
    events = [json.loads(it['message'])['message'] for it in browser.driver.get_log('performance')]
    asked = [it['params']['request']['url'] for it in events
             if it['method'] == 'Network.requestWillBeSent']
    assert asked
    assert [it for it in asked if not it.startswith((stand.url, 'data:', 'about:'))] == []
    assert browser.driver.get_log('browser') == []


_ALARMS = """page.showAlarms({
  alarms: [{text: 'kinect: object 1 is 0.05 m from a part of the robot with a long name', begin: 0,
            end: null, level: 4}],
  events: [{text: 'kinect: object 1 is 0.11 m from a part of the robot', time: 0}]});
"""
_OUTSIDE = """return [...document.querySelectorAll('#alarms li, #events li')].filter((it) =>
  it.lastChild.getBoundingClientRect().right > it.getBoundingClientRect().right + 1).length"""
_LABELS_OVER_EACH_OTHER = """
  const places = new Map();
  for (const name of ['a', 'b', 'c', 'd']) places.set(name, {at: page.scene.camera.position.clone()
    .add(page.scene.camera.localToWorld(page.scene.camera.position.clone().set(3, 3.4, -10))
    .sub(page.scene.camera.position)), lines: [{text: 'a label with many words', color: [1, 0, 0],
    kind: name}]});
  page.scene.blocks.forEach((it) => it.remove());
  page.scene.blocks.clear();
  page.scene.placeBlocks(places);
  const boxes = [...page.scene.blocks.values(), document.querySelector('.views')]
    .map((it) => it.getBoundingClientRect());
  return [boxes.length, boxes.flatMap((a, i) => boxes.slice(i + 1).filter((b) =>
    a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom)).length]"""


def test_times_and_labels_are_not_covered(stand: LiveStand) -> None:
    found = Browser(stand, (1400, 1000))
    try:
        assert found.run(_ALARMS + _OUTSIDE) == 0  # at once: the cell's own alarms replace these
        assert found.run('return document.documentElement.scrollWidth <= innerWidth')
        assert found.run(_LABELS_OVER_EACH_OTHER) == [5, 0]
    finally:
        found.driver.quit()


def test_names_are_shown_as_they_are_written(browser: Browser) -> None:
    assert browser.driver.title == f'Cell {LABEL}'
    assert browser.driver.find_element(By.TAG_NAME, 'h1').text == f'Cell {LABEL}'
    assert browser.run('return document.querySelectorAll("main script, main b").length') == 0


def test_it_is_paused_looked_back_and_live_again_while_the_cell_goes_on(
        browser: Browser, stand: LiveStand) -> None:
    browser.wait('page.transport.end - page.transport.begin > 3')
    browser.press(Keys.SPACE)
    browser.wait('!page.transport.isLive')
    held_s = float(browser.run('return page.transport.time'))
    browser.wait(f'page.transport.end > {held_s + 1.0}')
    assert browser.run('return page.transport.time') == held_s
    assert browser.link.startswith('Looking back: ')
    for back_s in (0.5, 1.7, 2.9):
        browser.run(f'page.transport.seek(page.transport.end - {back_s})')
        time_s, sent_s, place, text = browser.at_one_moment()
        assert sent_s <= time_s
        assert place == pytest.approx(stand.place(sent_s), abs=1e-5)
        assert text == f'F {stand.force(sent_s):.1f} N'
    browser.press(Keys.END)
    browser.wait('page.transport.isLive')
    browser.wait('document.getElementById("link").textContent === "Live"')


def test_unmodeled_objects_are_boxes_with_words_until_they_are_gone(
        browser: Browser, stand: LiveStand) -> None:
    message = DetectedObjects(objects=[DetectedObject(
        number=3, link='slide/head', distance=0.21, level=DetectedObject.WARN, is_seen=True)])
    message.header.frame_id = 'world'
    found = message.objects[0]
    found.pose.position.x, found.pose.position.z, found.pose.orientation.w = 0.6, 0.35, 1.0
    found.size.x, found.size.y, found.size.z = 0.2, 0.2, 0.3
    found.on_object.x = 0.5
    found.on_object.z = found.on_robot.z = 0.4
    found.on_robot.x = 0.15
    stand.seen = message
    labels = ('[...document.querySelectorAll(".label:not([hidden]) [data-kind=object]")]'
              '.map((it) => it.textContent)')
    browser.wait(f'{labels}.length === 2')
    assert browser.run(f'return {labels}') == ['object 3: 20 x 20 x 30 cm',
                                               '0.21 m to slide/head']
    assert browser.run('return page.scene.objects.group.children.length') == 3
    seen_s = float(browser.run('return page.transport.time'))
    stand.seen = None
    browser.wait('page.scene.objects.group.children.length === 0')
    browser.run(f'page.transport.seek({seen_s})')  # it is still there in the past
    browser.wait('page.scene.objects.group.children.length === 3')
    assert browser.driver.get_log('browser') == []


def test_playing_from_the_past_ends_in_the_present(browser: Browser) -> None:
    browser.wait('page.transport.end - page.transport.begin > 2')
    browser.run('page.transport.rate = 4; page.transport.pause();'
                'page.transport.seek(page.transport.end - 1.5); page.transport.toggle()')
    browser.wait('page.transport.isLive && !page.transport.isPlaying')


def test_a_new_page_has_the_last_minutes(browser: Browser, stand: LiveStand) -> None:
    browser.wait('page.transport.end - page.transport.begin > 3')
    other = Browser(stand)
    try:
        other.wait('page.transport.end - page.transport.begin > 3')
        assert other.run(f'return {_PLACE}.times.every('
                         '(it, row, all) => row === 0 || it > all[row - 1])')
        browser.wait('document.getElementById("viewers").textContent.startsWith("2 pages")')
    finally:
        other.driver.quit()


def test_the_band_of_good_runs_is_behind_its_curve(browser: Browser, stand: LiveStand) -> None:
    band = "page.timeline.lanes.find((it) => it.label === 'tool force')?.band"
    browser.wait(f'page.curves.length > 100 && {band} === null')
    stand.is_compared = True
    known = f'{band}.low.filter((it) => !Number.isNaN(it)).length'
    browser.wait(f'{band} && {known} > 60 && {band}.out.includes(1)')
    limits, steps = browser.run("""
      const lane = page.timeline.lanes.find((it) => it.label === 'tool force');
      const rows = lane.low.map((_, row) => row).filter((row) => lane.band.out[row] === 0
        && !Number.isNaN(lane.band.low[row]));
      return [rows.map((row) => [lane.low[row] - lane.band.low[row],
        lane.band.high[row] - lane.low[row]]),
        Object.values(page.curves.lanes).map((it) => it.band.low.length - it.low.length)]""")
    assert [number for row in limits for number in row] == pytest.approx(
        [3.0] * 2 * len(limits), abs=1e-4)
    assert set(steps) == {0}
    assert browser.run("return page.timeline.lanes.filter((it) => it.band).length") == 1
    browser.driver.get(stand.url)
    browser.wait(f'document.documentElement.dataset.ready === "true" && {band} && {known} > 60')


def test_a_cut_is_said_and_mended_with_what_happened_meanwhile(browser: Browser,
                                                               stand: LiveStand) -> None:
    browser.wait('page.transport.end - page.transport.begin > 1')
    stand.cut()
    browser.wait('document.documentElement.classList.contains("lost")')
    assert browser.link.startswith('No connection to the cell since ')
    cut_s = float(browser.run('return page.transport.end'))
    browser.wait('/\\([2-9] s\\)/.test(document.getElementById("link").textContent)')
    stand.mend()
    browser.wait('!document.documentElement.classList.contains("lost")')
    browser.wait(f'page.transport.end > {cut_s + 2.0}')
    browser.wait(f'{_PLACE}.times.every((it, row, all) => row === 0 || it - all[row - 1] < 1)')
    errors = [it for it in browser.driver.get_log('browser')
              if 'ERR_CONNECTION' not in it['message'] and 'WebSocket' not in it['message']]
    assert errors == []


def test_a_cell_that_ends_is_said(browser: Browser, stand: LiveStand) -> None:
    stand.live.take_problem('The cell does not run', stand.now_s())
    browser.wait('document.documentElement.classList.contains("lost")')
    assert browser.link.startswith('The cell does not run since ')
    stand.live.take_problem('', stand.now_s())
    browser.wait('!document.documentElement.classList.contains("lost")')
    browser.wait('document.querySelectorAll("#events li").length === 2')


def test_alarms_lead_to_their_time_and_what_nodes_say_stands_at_the_device(
        browser: Browser, stand: LiveStand) -> None:
    assert browser.driver.find_element(By.ID, 'alarms').text == 'No alarms'
    browser.wait('page.transport.end - page.transport.begin > 1')
    stand.warn('heat above 400 K')
    browser.wait('document.querySelector("#alarms .level4") !== null')
    alarm_s = float(browser.run('return page.cellState.alarms[0].begin'))
    browser.run('document.querySelector("#alarms .level4 button").click()')
    browser.wait(f'Math.abs(page.transport.time - {alarm_s}) < 0.01')
    browser.run('page.transport.goLive()')
    stand.note = 'slide: robot_proc does not respond'
    browser.wait('[...document.querySelectorAll(".label [data-kind=note]")].some((it) => '
                 'it.textContent === "slide: robot_proc does not respond")')


def test_a_phone_shows_it_without_scrolling_sideways(stand: LiveStand) -> None:
    browser = Browser(stand, PHONE)
    try:
        browser.wait('page.curves.length > 100')
        assert browser.run('return document.documentElement.scrollWidth') == PHONE[0]
    finally:
        browser.driver.quit()


@pytest.mark.parametrize('size', [WIDE, PHONE])
def test_everybody_can_use_it(stand: LiveStand, size: 'tuple[int, int]') -> None:
    axe = axe_script()
    if axe is None:
        pytest.skip('axe-core-python is not installed')
    browser = Browser(stand, size)
    try:
        browser.driver.execute_cdp_cmd('Page.setBypassCSP', {'enabled': True})
        browser.driver.get(stand.url)
        browser.wait('document.documentElement.dataset.ready === "true"')
        browser.wait('page.curves.length > 100')
        stand.warn('heat above 400 K')
        browser.wait('document.querySelector("#alarms .level4") !== null')
        assert faults(browser.driver, axe) == []
    finally:
        browser.driver.quit()
