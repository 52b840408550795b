// SPDX-License-Identifier: BSD-3-Clause
// Starts the page: of runs, with their data in the document, or of a running cell.

import {openLivePage} from './live_page.js';
import {Columns, unpacked} from './packed.js';
import {Page, made} from './page.js';

async function begin() {
  const {documentElement} = document;
  if (typeof DecompressionStream === 'undefined') {
    document.getElementById('player')?.append(made('p', 'This browser is too old for this page: '
      + 'Chromium 80, Firefox 113, Safari 16.4 or later show it. The words are all here.'));
    return;
  }
  const data = document.getElementById('data');
  const page = data === null ? await openLivePage() : new Page(JSON.parse(data.textContent ?? '{}'),
    new Columns(await unpacked(document.getElementById('columns')?.textContent ?? '')));
  Object.assign(globalThis, {page});
  documentElement.dataset.ready = 'true';
}

begin();
