# SPDX-License-Identifier: BSD-3-Clause
"""The page of ``cell share`` in a real browser: opened as a file; playback, seeks and steps."""
from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Iterator, List

import numpy as np
import pytest
from page_faults import axe_script, faults
from page_reader import PageReader
from selenium.webdriver import Chrome
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait
from sewing_runs import CELL, write_sewing_run

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.commands.command_line import main
from process_visualizer.curves.position_values import PositionValues, key_of
from process_visualizer.robot.arrows import variable_text

WIDE, PHONE = (1920, 1080), (390, 844)
WITH_WEBGL = ('--use-angle=swiftshader', '--enable-unsafe-swiftshader')
WITHOUT_WEBGL = ('--disable-3d-apis',)
_LIMIT_S = 60
_LABELS = {'speed': 'v', 'force': 'F'}


class Shared:
    """A page, and the recording from which it was made."""

    def __init__(self, folder: Path) -> None:
        self.bag = write_sewing_run(folder, 'poor.bag', 2, is_poor=True)
        good = write_sewing_run(folder, 'good.bag')
        self.path = folder / 'page.html'
        assert main(['share', f'{self.bag}#1', '--reference', good, '-o', str(self.path)]) == 0


class Browser:
    """Chromium with the page in it."""

    def __init__(self, shared: Shared, *flags: str, size: 'tuple[int, int]' = WIDE) -> None:
        options = Options()
        for flag in ('--headless=new', '--no-sandbox', '--disable-dev-shm-usage', *flags):
            options.add_argument(flag)
        options.set_capability('goog:loggingPrefs', {'browser': 'ALL', 'performance': 'ALL'})
        self.driver = Chrome(service=Service('/usr/bin/chromedriver'), options=options)
        self.driver.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', {
            'width': size[0], 'height': size[1], 'deviceScaleFactor': 1, 'mobile': size == PHONE})
        self.url = shared.path.as_uri()
        self.open('')

    def open(self, place: str) -> None:
        self.driver.get('about:blank')
        self.driver.get(self.url + place)
        self.wait('document.documentElement.dataset.ready === "true"')
        self.wait('document.documentElement.dataset.time !== undefined')

    def run(self, script: str) -> Any:
        return self.driver.execute_script(script)

    def wait(self, condition: str) -> None:
        WebDriverWait(self.driver, _LIMIT_S, 0.02).until(
            lambda _: self.run(f'return Boolean({condition})'), condition)

    @property
    def time_s(self) -> float:
        """Return the time of the drawn frame."""
        return float(self.run('return document.documentElement.dataset.time'))

    def press(self, *keys: str) -> None:
        ActionChains(self.driver).send_keys(*keys).perform()

    def seek(self, time_s: float) -> None:
        self.run(f'page.transport.seek({time_s})')
        self.wait(f'Math.abs(document.documentElement.dataset.time - {time_s}) < 1e-3')

    def texts(self) -> List[str]:
        return [it.text for it in self.driver.find_elements(By.CSS_SELECTOR, '#numbers td')]


@pytest.fixture(scope='module')
def shared(tmp_path_factory: pytest.TempPathFactory) -> Shared:
    return Shared(tmp_path_factory.mktemp('browser'))


@pytest.fixture(scope='module')
def chromium(shared: Shared) -> Iterator[Browser]:
    browser = Browser(shared, *WITH_WEBGL)
    yield browser
    browser.driver.quit()


@pytest.fixture
def browser(chromium: Browser) -> Browser:
    chromium.open('')
    return chromium


def test_nothing_is_fetched_and_nothing_goes_wrong(browser: Browser) -> None:
    events = [json.loads(it['message'])['message'] for it in browser.driver.get_log('performance')]
    asked = [it['params']['request']['url'] for it in events
             if it['method'] == 'Network.requestWillBeSent']
    assert asked
    assert [it for it in asked if not it.startswith((browser.url, 'data:', 'about:'))] == []
    assert browser.driver.get_log('browser') == []


def test_it_plays_in_both_directions_and_pauses(browser: Browser) -> None:
    begin_s = browser.time_s
    browser.press(Keys.SPACE)
    browser.wait(f'document.documentElement.dataset.time > {begin_s + 0.5}')
    browser.press(Keys.SPACE)
    browser.wait('!page.transport.isPlaying')
    there_s = browser.time_s
    ActionChains(browser.driver).key_down(Keys.SHIFT).send_keys(Keys.SPACE).key_up(
        Keys.SHIFT).perform()
    browser.wait(f'document.documentElement.dataset.time < {there_s - 0.2}')
    browser.press(Keys.SPACE, Keys.SPACE)
    browser.wait('!page.transport.isPlaying')


def test_a_slow_computer_keeps_time_and_a_hidden_page_stands_still(browser: Browser) -> None:
    browser.seek(1.0)
    shown_s = browser.run("""
        const {transport} = page, shown = [];
        const draw = (ms) => { page.frame(ms); shown.push(transport.time); };
        transport.isPlaying = true;
        draw(1000);
        draw(3000);
        document.dispatchEvent(new Event('visibilitychange'));
        draw(9000);
        draw(9500);
        transport.pause();
        draw(9600);
        return shown;""")
    assert shown_s == pytest.approx([1.0, 3.0, 3.0, 3.5, 3.5])


def test_steps_and_jumps_by_keys(browser: Browser) -> None:
    browser.seek(5.0)
    browser.press(Keys.ARROW_RIGHT)
    browser.wait('document.documentElement.dataset.time > 5')
    assert browser.time_s - 5.0 < 0.02
    browser.press(',', ',')
    browser.wait('document.documentElement.dataset.time < 5')
    browser.press(Keys.END)
    browser.wait('page.transport.time === page.transport.end')
    browser.press(Keys.HOME, Keys.PAGE_DOWN)
    browser.wait('Math.abs(document.documentElement.dataset.time'
                 ' - page.run.moments[0].at) < 1e-3')
    browser.press(']')
    browser.wait('page.transport.rate === 1.5')


def test_a_click_on_the_timeline_or_a_departure_goes_there(browser: Browser) -> None:
    timeline = browser.driver.find_element(By.CSS_SELECTOR, '.timeline canvas')
    ActionChains(browser.driver).move_to_element(timeline).click().perform()
    browser.wait('document.documentElement.dataset.time > 4')
    browser.driver.find_element(By.CSS_SELECTOR, '.departures a').click()
    browser.wait('Math.abs(document.documentElement.dataset.time'
                 ' - page.run.departures[0].began_s) < 1e-3')
    browser.wait('/#t=\\d/.test(location.hash)')


def test_an_address_leads_to_a_moment(browser: Browser) -> None:
    browser.open('#t=8.2')
    assert browser.time_s == pytest.approx(8.2)


def test_numbers_are_those_of_the_launcher_wherever_it_comes_from(browser: Browser,
                                                                  shared: Shared) -> None:
    """Positions are reached forwards, backwards and by seeks; the words are RViz's."""
    positions_s = np.random.default_rng(5).uniform(0.6, 17.5, 24)
    positions_s = np.concatenate((positions_s[:8], np.sort(positions_s[8:16]),
                                  -np.sort(-positions_s[16:])))
    values = PositionValues([shared.bag], XmlParser().parse(str(CELL)).devices)
    entries = browser.run('return page.data.runs[0].numbers.map('
                          '(it) => [it.device, it.quantity, it.label, it.topic])')
    try:
        for time_s in positions_s.tolist():
            browser.seek(time_s)
            known = values.at(browser.run('return page.transport.time'))
            for (device, quantity, label, topic), text in zip(entries, browser.texts()):
                value = known[key_of(device, _LABELS.get(quantity, label), topic)]
                assert value is not None
                assert text == _words(quantity, label, value)
    finally:
        values.close()


LINKS = """const parts = (entries, shown) => entries.map((it, row) => [
    it.place, shown[row].mesh.visible, Array.from(shown[row].mesh.matrix.elements)]);
  return [...parts(page.run.parts, page.scene.parts),
    ...parts(page.run.ghost.parts, page.scene.ghost.parts)];"""


def test_links_are_where_the_data_has_them(browser: Browser, shared: Shared) -> None:
    """The run's links follow the last message, the ghost's are interpolated between two rows."""
    reader = PageReader(shared.path.read_text(encoding='utf-8'))
    for time_s in np.random.default_rng(6).uniform(0.6, 17.5, 8).tolist():
        browser.seek(time_s)
        links = browser.run(LINKS)
        assert all(is_visible for _, is_visible, _ in links)
        for number, _, elements in links:
            position, _ = reader.place(0, number, browser.run('return page.transport.time'))
            assert elements[12:15] == pytest.approx(position.tolist(), abs=1e-5)


@pytest.mark.parametrize(('between', 'x_m'), [(True, 0.8), (False, 0.0)])
def test_the_ghost_moves_between_rows_however_far_apart(browser: Browser, between: bool,
                                                        x_m: float) -> None:
    """This is as in RViz; the recorded positions of the run stay unchanged."""
    browser.seek(2.0)
    browser.run(f"""page.scene.parts[0].place = {{times: [0, 10], positions: [0, 0, 0, 1, 0, 0],
        turns: [0, 0, 0, 32767, 0, 0, 0, 32767], between: {json.dumps(between)}}};""")
    browser.seek(8.0)
    assert browser.run('return page.scene.parts[0].mesh.matrix.elements[12]') == pytest.approx(x_m)


def _words(quantity: str, label: str, value: float) -> str:
    """Return the words of RViz: the edges are integers."""
    if quantity in _LABELS:
        return f'v {value:.3f} m/s' if quantity == 'speed' else f'F {value:.1f} N'
    variable = next(it for device in XmlParser().parse(str(CELL)).devices
                    for it in device.variables if it.label == label)
    return variable_text(label, int(value) if 'edge' in label else value, variable.unit,
                         variable.offset, variable.scale)


def test_the_view_is_turned_with_the_mouse(browser: Browser) -> None:
    before = browser.run('return page.scene.camera.position.toArray()')
    scene = browser.driver.find_element(By.CSS_SELECTOR, '.scene canvas')
    ActionChains(browser.driver).drag_and_drop_by_offset(scene, 80, 20).perform()
    browser.wait(f'Math.hypot(...page.scene.camera.position.toArray().map('
                 f'(it, i) => it - {before}[i])) > 0.1')


def test_fifty_numbers_at_one_place_do_not_hide_the_cell(browser: Browser) -> None:
    browser.run("""const lines = Array.from({length: 50}, (_, row) => (
        {text: `p ${row}`, color: [1, 0, 0], kind: 'number'}));
      const tip = page.scene.arrows[0].tip.clone();
      page.scene.placeBlocks(new Map([['many', {at: tip.set(0, 0, 0), lines}]]));""")
    texts = [it.get_property('textContent') for it in browser.driver.find_elements(
        By.CSS_SELECTOR, '.label')]
    assert any(it.endswith('p 6and 43 more') for it in texts)


def test_without_webgl_everything_else_works(shared: Shared) -> None:
    browser = Browser(shared, *WITHOUT_WEBGL)
    try:
        assert 'no pictures in three dimensions' in browser.driver.find_element(
            By.CLASS_NAME, 'scene').text
        browser.seek(8.0)
        assert browser.texts()[1].startswith('F ')
        assert browser.driver.get_log('browser') == []
    finally:
        browser.driver.quit()


@pytest.mark.parametrize('width', [1000, 1280])
def test_no_value_is_cut_in_a_narrow_window(shared: Shared, width: int) -> None:
    """Values of a device with a long name are not cut either."""
    browser = Browser(shared, *WITH_WEBGL, size=(width, 800))
    try:
        browser.run("""const rows = document.querySelectorAll('#numbers tr');
            rows[0].children[0].append('_with_a_name_of_forty_or_so_characters');
            const text = ' no data for 12.3 s'.repeat(3);
            rows[rows.length - 1].children[1].append(text)""")
        assert browser.run("""const panel = document.getElementById('values');
            const right = panel.getBoundingClientRect().right;
            return [...panel.querySelectorAll('th, td')].filter(it =>
                it.scrollWidth > it.clientWidth || it.getBoundingClientRect().right > right)
                .map(it => it.textContent)""") == []
        assert browser.run('return document.documentElement.scrollWidth '
                           '<= document.documentElement.clientWidth')
    finally:
        browser.driver.quit()


@pytest.mark.parametrize(('size', 'flags', 'state'), [
    (WIDE, WITH_WEBGL, ''), (PHONE, WITH_WEBGL, ''), (WIDE, WITHOUT_WEBGL, ''),
    (WIDE, WITH_WEBGL, 'page.toggleTheme()'), (WIDE, WITH_WEBGL, 'page.help.showModal()')])
def test_everybody_can_use_it(shared: Shared, size: 'tuple[int, int]', flags: 'tuple[str, ...]',
                              state: str) -> None:
    axe = axe_script()
    if axe is None:
        pytest.skip('axe-core-python is not installed')
    browser = Browser(shared, *flags, size=size)
    try:
        browser.driver.execute_cdp_cmd('Page.setBypassCSP', {'enabled': True})
        browser.open('')
        browser.run(state)
        assert faults(browser.driver, axe) == []
    finally:
        browser.driver.quit()


def test_a_phone_shows_it_without_scrolling_sideways(shared: Shared) -> None:
    browser = Browser(shared, *WITH_WEBGL, size=PHONE)
    try:
        assert browser.run('return document.documentElement.scrollWidth') == PHONE[0]
        assert browser.driver.find_element(By.CLASS_NAME, 'verdict').text.startswith(
            'out of range')
    finally:
        browser.driver.quit()


LONG = 'Temperature of the third heating zone behind the second cooling roller, smoothed'
OUTSIDE = f"""const found = [], kind = CanvasRenderingContext2D.prototype, fill = kind.fillText;
  kind.fillText = function(text, x, y) {{
    const width = this.measureText(text).width;
    const left = x - {{left: 0, center: width / 2, right: width}}[this.textAlign];
    if (left < 0 || left + width > page.timeline.width) found.push(text);
    fill.call(this, text, x, y);
  }};
  for (const lane of page.timeline.lanes) Object.assign(lane, {{device: 'extruder_'.repeat(6),
    label: '{LONG}', unit: 'mm/s'}});
  page.timeline.paint();
  kind.fillText = fill;
  return found;"""


@pytest.mark.parametrize('size', [WIDE, PHONE])
def test_no_text_of_the_curves_is_cut_off(shared: Shared, size: 'tuple[int, int]') -> None:
    browser = Browser(shared, *WITH_WEBGL, size=size)
    try:
        assert browser.run(OUTSIDE) == []
    finally:
        browser.driver.quit()


def test_a_long_label_in_the_picture_keeps_its_value(shared: Shared) -> None:
    browser = Browser(shared, *WITH_WEBGL, size=PHONE)
    try:
        right, bottom, width, height = browser.run(f"""
            const lines = [{{text: '{LONG} -12.345 °C', color: [1, 0, 0], kind: 'number'}}];
            page.scene.placeBlocks(new Map([['long', {{lines,
              at: page.scene.arrows[0].tip.clone().set(0, 0, 0)}}]]));
            const box = page.sceneBox.getBoundingClientRect();
            const label = [...document.querySelectorAll('.label')].find(
              (it) => it.textContent.endsWith('°C')).getBoundingClientRect();
            return [label.right - box.left, label.bottom - box.top, box.width, box.height];""")
        assert right <= width and bottom <= height
    finally:
        browser.driver.quit()


def test_departures_that_begin_together_are_all_numbered(browser: Browser) -> None:
    assert browser.run("""const found = [], kind = CanvasRenderingContext2D.prototype,
          fill = kind.fillText;
        kind.fillText = function(text, x, y) { if (/^[12]$/.test(text) && y < 30) found.push(x); };
        const departures = [...page.run.departures];
        page.timeline.run = {...page.run, departures: [departures[0], departures[0]]};
        page.timeline.paint();
        kind.fillText = fill;
        page.timeline.run = page.run;
        return found[1] - found[0];""") >= 14


def test_a_variable_called_force_has_a_label_in_the_picture(browser: Browser) -> None:
    browser.run("""const [number] = page.numbers.filter((it) => it.quantity === 'number');
        const [arrow] = page.scene.arrows;
        page.scene.arrows.push({...arrow, device: number.device, isVariable: true,
          quantity: number.label = 'force'});
        page.draw(page.transport.time);""")
    variables = browser.run("return page.scene.blocks.get('sewing_machine variables').textContent")
    assert variables.startswith('feed ')


def test_a_picture_without_anything_says_so(browser: Browser) -> None:
    nothing = browser.driver.find_element(By.CLASS_NAME, 'nothing')
    assert not nothing.is_displayed()
    browser.run("""Object.assign(page.run, {parts: [], arrows: []});
        page.show(0);""")
    assert 'no model' in nothing.text


def test_paper_gets_a_light_picture_of_its_own_width(browser: Browser) -> None:
    browser.run('page.toggleTheme(); dispatchEvent(new Event("beforeprint"));')
    width, colors = browser.run("""const copy = document.querySelector('.scene .copy');
        const pixels = copy.getContext('2d').getImageData(0, 0, copy.width, copy.height).data;
        return [page.timeline.width, new Set(new Uint32Array(pixels.buffer)).size];""")
    assert width < 700 and colors > 100
    assert browser.run('return document.documentElement.dataset.theme') == 'light'
    browser.run('dispatchEvent(new Event("afterprint"));')
    assert browser.run('return [document.querySelectorAll(".copy").length, '
                       'document.documentElement.dataset.theme, page.timeline.width > 700]') == [
                           0, 'dark', True]
