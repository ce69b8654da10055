// The live page of youbotd in the browser, with a teleoperation in real time and with a service over the emulated bus:
//     node page_test.mjs YOUBOTD FOLDER
// Leaves screenshots in FOLDER; page.png is the picture of README.md (docs/page.png).
import assert from 'node:assert/strict';
import {mkdirSync, rmSync} from 'node:fs';
import {join} from 'node:path';

import {launch} from './chromium.mjs';
import {brokenLinks, click, config, enable, open, patient, point, shown, start, state} from './live_page.mjs';
import {checks, emulate, listen, photograph, until} from './report_page.mjs';

const [youbotd, folder] = process.argv.slice(2);
rmSync(folder, {recursive: true, force: true});
mkdirSync(folder, {recursive: true});

const browser = await launch();
const {complaints, requests} = listen(browser);
for (const domain of ['Page', 'Runtime', 'Log', 'Network']) await browser.send(`${domain}.enable`);
await emulate(browser, 'light');
const {check, summary} = checks(browser, folder);
const number_in = selector => browser.evaluate(name => parseFloat(document.querySelector(name)?.textContent), selector);
// Without those of the driver, and of a page that still asks for a daemon that has ended.
const expected = ['GPU stall due to ReadPixels'];
const own_complaints = () => complaints.filter(text => !expected.some(part => text.includes(part)));

// --- A run from the command line ---
const run = start(youbotd, ['--config', config('teleop.toml'), '--demo']);
try {
  const [, url] = await run.find(/page: (http:\S+)/);
  await open(browser, url, {width: 1400, height: 1180});
  await check('the state follows the run', async () => {
    await until(() => state(browser), text => text === 'teleoperation: unfolding, commanded by the command line');
    await until(() => state(browser), text => text === 'teleoperation: operating, commanded by the command line');
  });
  await check('every joint has its position, and an arm joint its range', async () => {
    const rows = await browser.evaluate(() => [...document.querySelectorAll('#joints tr')].map(row => ({
      name: row.cells[0].textContent, position: row.cells[1].textContent, range: Boolean(row.querySelector('.range'))})));
    assert.deepEqual(rows.map(({name}) => name),
      ['wheel-1', 'wheel-2', 'wheel-3', 'wheel-4', 'arm-1', 'arm-2', 'arm-3', 'arm-4', 'arm-5']);
    for (const {position} of rows) assert.match(position, /^-?\d+\.\d{3} rad$/);
    assert.deepEqual(rows.map(({range}) => range), [false, false, false, false, true, true, true, true, true]);
  });
  await check('the plots draw, and another signal can be added', async () => {
    await until(() => browser.evaluate(() => document.querySelectorAll('.plot canvas').length), count => count >= 4);
    await browser.evaluate(() => {
      const input = document.querySelector('.plot input');
      input.value = 'tank_J';
      input.dispatchEvent(new Event('change'));
    });
    const chips = await browser.evaluate(() => [...document.querySelectorAll('.plot')[0].querySelectorAll('.chip')]
      .map(chip => chip.textContent));
    assert.deepEqual(chips, ['grip_force_held_x_N', 'grip_force_held_y_N', 'grip_force_held_z_N', 'tank_J']);
  });
  await check('the hand feels a force of the demo', async () => {
    await until(() => number_in('#felt-text'), newton => newton > 1);
    await photograph(browser, join(folder, 'page.png'));
  });
  await check('it loads nothing from elsewhere', () => {
    for (const request of requests) assert.ok(request.startsWith(url) || request.startsWith('data:'), request);
  });
  await check('the stop button ends the run, without a token', async () => {
    await click(browser, '#stop');
    await until(() => state(browser), text => /stopping|lowering|ended|No connection/.test(text));
    assert.equal(await run.ended, 130);
    assert.match(run.log, /coming to rest: requested by the page at 127\.0\.0\.1/);
    await until(() => state(browser), text => text === 'The run has ended');
  });
  expected.push('ERR_CONNECTION_REFUSED', `WebSocket connection to 'ws://${new URL(url).host}/`);
  await check('the console is free of errors', () => assert.deepEqual(own_complaints(), []));
} finally {
  run.child.kill('SIGKILL');
}

// --- A service, on a phone ---
complaints.length = 0;
const service = start(youbotd, ['--config', patient(folder), '--robot', 'wire', '--control', join(folder, 'control')]);
try {
  const [, url] = await service.find(/page: (http:\S+)/);
  const [, token] = await service.find(/#token=([0-9a-f]{32})/);
  const phone = {width: 390, height: 844, mobile: true};
  await open(browser, url, phone);
  await check('without a token there are no commands', async () => {
    await until(() => state(browser), text => text === 'Drives off');
    assert.equal(await shown(browser, 'no-token'), true);
    assert.equal(await shown(browser, 'enable'), false);
  });
  await check('it says what keeps the robot from being enabled', async () => {
    assert.notEqual(await browser.evaluate(() => document.querySelectorAll('#reasons li').length), 0);
  });
  await check('a wrong token is refused', async () => {
    await open(browser, 'about:blank', phone);
    await open(browser, `${url}#token=${'0'.repeat(32)}`, phone);
    await until(() => browser.evaluate(() => document.getElementById('message')?.textContent),
      text => /^this token is not/.test(text ?? ''));
    assert.equal(await shown(browser, 'enable'), false);
  });
  await check('with the token the commands appear, and the address keeps it no longer', async () => {
    await open(browser, 'about:blank', phone);
    await open(browser, `${url}#token=${token}`, phone);
    await until(() => shown(browser, 'enable'), Boolean);
    assert.equal(await browser.evaluate(() => location.href), url);
  });
  await check('the bus is drawn in its order', async () => {
    const names = await until(() => browser.evaluate(() => [...document.querySelectorAll('#bus text')]
      .map(text => text.textContent)), list => list.length > 1);  // the devices come with the first status
    assert.deepEqual(names, ['youbotd', 'slave 1 (KR-845)', 'slave 2 (TMCM-1632)', 'slave 3 (TMCM-1632)',
      'slave 4 (TMCM-1632)', 'slave 5 (TMCM-1632)']);
    assert.equal(await brokenLinks(browser), 0);
  });
  const x_m = () => browser.evaluate(() => {
    const stored = [...document.querySelectorAll('#joints tr')].map(row => parseFloat(row.cells[1].textContent));
    return stored[1] - stored[0];
  });
  await check('enabled from the page, it drives as long as a button is held', async () => {
    await enable(browser, 'velocity');
    await until(() => shown(browser, 'drive'), Boolean);
    const before = await until(x_m, Number.isFinite);
    // The page may still move under the pointer: it presses again until the base drives.
    await until(async () => {
      await point(browser, '[data-drive="1 0 0"]', 'mousePressed');
      for (const end = Date.now() + 3000; Date.now() < end;)
        if (Math.abs(await x_m() - before) > 1) return true;
      await point(browser, '[data-drive="1 0 0"]', 'mouseReleased');
      return false;
    }, Boolean);
    await photograph(browser, join(folder, 'phone.png'));
    await point(browser, '[data-drive="1 0 0"]', 'mouseReleased');
  });
  await check('no part is wider than the phone', async () => {
    const {page, window} = await browser.evaluate(() =>
      ({page: document.documentElement.scrollWidth, window: document.documentElement.clientWidth}));
    assert.equal(page, window);
  });
  await check('Escape stops it', async () => {
    assert.match(await state(browser), /^velocity: running/);
    await browser.send('Input.dispatchKeyEvent', {type: 'keyDown', key: 'Escape', code: 'Escape'});
    await until(() => state(browser), text => text === 'Drives off');
    await until(() => browser.evaluate(() => document.getElementById('message').textContent), text => text === '');
    assert.match(service.log, /coming to rest: requested by the page at /);
  });
  await check('the robot comes to rest when the page that commands is closed', async () => {
    await enable(browser, 'velocity');
    await open(browser, 'about:blank', phone);
    await service.find(/coming to rest: the page at \S+ is gone/);
  });
  await check('a daemon that stands still is noticed, and so is its return', async () => {
    await open(browser, url, phone);
    await until(() => state(browser), text => text === 'Drives off');
    service.child.kill('SIGSTOP');
    await until(() => state(browser), text => /^No data for more than 1 s/.test(text));
    service.child.kill('SIGCONT');
    await until(() => state(browser), text => text === 'Drives off');
  });
  await check('it is readable in the dark', async () => {
    await emulate(browser, 'dark');
    await open(browser, url, {width: 1400, height: 900});
    await until(() => state(browser), text => text === 'Drives off');
    await photograph(browser, join(folder, 'dark.png'));
  });
  await check('the console is free of errors', () => assert.deepEqual(own_complaints(), []));
} finally {
  service.child.kill('SIGTERM');
  await service.ended;
}
await browser.close();
console.log(summary());
