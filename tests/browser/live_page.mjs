// youbotd with its live page, and what an operator does there.
import assert from 'node:assert/strict';
import {spawn} from 'node:child_process';
import {readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {fileURLToPath} from 'node:url';

import {until} from './report_page.mjs';

export const config = name => fileURLToPath(new URL(`../../apps/youbotd/${name}`, import.meta.url));

// The configuration of the base. A busy machine may keep the browser waiting for longer than the default, and the robot
// would come to rest.
export function patient(folder) {
  const file = join(folder, 'patient.toml');
  writeFileSync(file, readFileSync(config('demo.toml'), 'utf8')
    .replace(/commander_timeout_s = \S+/, 'commander_timeout_s = 10'));
  return file;
}

// Runs youbotd; `log` grows, `find` waits for a line in it.
export function start(youbotd, options) {
  const child = spawn(youbotd, [...options, '--page', '127.0.0.1:0'], {stdio: ['ignore', 'ignore', 'pipe']});
  const daemon = {child, log: '', ended: new Promise(resolve => child.on('exit', code => resolve(code)))};
  child.stderr.setEncoding('utf8').on('data', text => { daemon.log += text; });
  daemon.find = pattern => until(async () => daemon.log.match(pattern), Boolean);
  return daemon;
}

export async function open(page, url, {width, height, mobile = false}) {
  await page.send('Emulation.setDeviceMetricsOverride', {width, height, deviceScaleFactor: 1, mobile});
  const {errorText} = await page.send('Page.navigate', {url});
  assert.equal(errorText, undefined);
}

export const state = page => page.evaluate(() => document.getElementById('state')?.textContent ?? '');
export const shown = (page, id) => page.evaluate(name => {
  const node = document.getElementById(name);
  return node !== null && !node.closest('[hidden]');
}, id);
export const brokenLinks = page => page.evaluate(() => document.querySelectorAll('#bus .broken').length);

// With a real pointer, so that what covers a button counts.
export async function point(page, selector, kind) {
  const place = await page.evaluate(name => {
    const node = document.querySelector(name);
    node.scrollIntoView({block: 'center'});
    const {x, y, width, height} = node.getBoundingClientRect();
    return {x: x + width / 2, y: y + height / 2};
  }, selector);
  await page.send('Input.dispatchMouseEvent', {type: kind, button: 'left', clickCount: 1, ...place});
}
export async function click(page, selector) {
  await point(page, selector, 'mousePressed');
  await point(page, selector, 'mouseReleased');
}

// Repeats what a busy machine makes the page or youbotd refuse: the button may have moved under the pointer, and a page
// that was silent for 0.5 s is asked to send its request again.
async function insist(page, act, reached) {
  await until(async () => {
    await act();
    let seen;
    for (const end = Date.now() + 5000; Date.now() < end; await new Promise(resolve => setTimeout(resolve, 20))) {
      seen = await page.evaluate(() => ({state: document.getElementById('state').textContent,
        mode: document.getElementById('mode').value, message: document.getElementById('message').textContent}));
      if (reached(seen) || seen.message !== '') break;
    }
    return seen;
  }, reached);
}

export async function enable(page, mode) {
  await insist(page, () => page.evaluate(wanted => {
    const list = document.getElementById('mode');
    list.value = wanted;
    list.dispatchEvent(new Event('change'));
    list.value = '';  // until a status selects the mode of youbotd
  }, mode), seen => seen.mode === mode);
  await insist(page, () => click(page, '#enable'),
    seen => seen.state.startsWith(`${mode}: running, commanded by the page at `));
}
