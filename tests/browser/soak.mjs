// The service and its page for a long time: youbotd over a veth pair to youbot-sim with faults on the bus, an operator in
// the browser who acknowledges, enables and drives, and clients that read, that do not read, and that come and go.
//     unshare --net node soak.mjs YOUBOTD YOUBOT_SIM FOLDER MINUTES
// Needs root. Prints memory, handles and state every minute. Fails if memory or handles grow, if the robot is not
// running again after the last fault, or if the page never drew a broken link.
import assert from 'node:assert/strict';
import {execFileSync, spawn} from 'node:child_process';
import {mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync} from 'node:fs';
import {request} from 'node:http';
import {connect} from 'node:net';
import {join} from 'node:path';

import {launch} from './chromium.mjs';
import {brokenLinks, click, open, patient, point, shown, start, state} from './live_page.mjs';
import {listen, until} from './report_page.mjs';

const [youbotd, youbot_sim, folder, duration] = process.argv.slice(2);
const minutes = Number(duration);
assert.ok(minutes > 0, `${duration} is no number of minutes`);
const kFaultEvery_s = 20;
const kFirstFault_s = 15;
const kWarmUp_min = 5;      // caches fill
const kGrowth_bytes = 8e6;

const faults = [
  'kind = "cable_out"\nslave = 3\nduration_s = 3.0',
  'kind = "drop_reply"\ncount = 200',
  'kind = "slave_off"\nslave = 4\nduration_s = 1.0',
  'kind = "wrong_counter"\ncount = 200',
  'kind = "board_fault"\nslave = 2\nboard_fault = "overtemperature"\nduration_s = 1.0',
  'kind = "brown_out"\nduration_s = 0.5',
];

rmSync(folder, {recursive: true, force: true});
mkdirSync(folder, {recursive: true});
const pause = ms => new Promise(resolve => setTimeout(resolve, ms));

// --- The robot ---
for (const command of ['link set lo up', 'link add veth-s type veth peer name veth-c', 'link set veth-s up',
  'link set veth-c up']) execFileSync('ip', command.split(' '));
const script = join(folder, 'faults.toml');
const events = [];
for (let at_s = kFirstFault_s; at_s < 60 * minutes; at_s += kFaultEvery_s)
  events.push(`[[fault]]\nat_s = ${at_s}.0\n${faults[events.length % faults.length]}\n`);
writeFileSync(script, events.join('\n'));
const sim = spawn(youbot_sim, ['--interface', 'veth-s', '--robot', 'base', '--faults', script],
  {stdio: ['ignore', 'pipe', 'inherit']});
await new Promise(resolve => sim.stdout.once('data', resolve));
sim.stdout.resume();
let code;
const service = start(youbotd, ['--config', patient(folder), '--robot', 'ethercat:veth-c', '--allow-non-rt',
  '--control', join(folder, 'control'), '--record', join(folder, 'runs')]);
const browser = await launch();

// --- Clients ---
function textFrame(text) {  // masked with zeros
  const head = Buffer.alloc(8);
  head.writeUInt16BE(0x81FE, 0);
  head.writeUInt16BE(text.length, 2);
  return Buffer.concat([head, Buffer.from(text)]);
}

function view(port, reads) {
  const client = request({host: '127.0.0.1', port, headers: {
    'Connection': 'Upgrade', 'Upgrade': 'websocket', 'Sec-WebSocket-Version': '13',
    'Sec-WebSocket-Key': 'c29ha2luZyBjbGllbnQgIQ==', 'Sec-WebSocket-Protocol': 'foxglove.sdk.v1'}});
  client.on('error', () => {});  // the server ends clients that do not read
  client.on('upgrade', (_, socket) => {
    const subscriptions = Array.from({length: 12}, (unused, i) => ({id: i + 1, channelId: i + 1}));
    socket.on('error', () => {}).write(textFrame(JSON.stringify({op: 'subscribe', subscriptions})));
    if (reads) socket.resume();
    else socket.pause();
    client.stream = socket;
  });
  client.end();
  return client;
}

async function comeAndGo(port) {
  for (;; await pause(250)) {
    const viewer = view(port, true);
    const stranger = connect(port, '127.0.0.1').on('error', () => {});
    stranger.write('GET /nothing HTTP/9.9\r\nHost: \u0000\r\n\r\n');
    await pause(250);
    viewer.stream?.destroy();
    stranger.destroy();
  }
}

// --- Measures ---
const daemon_bytes = () => 1024 * readFileSync(`/proc/${service.child.pid}/status`, 'utf8').match(/VmRSS:\s+(\d+)/)[1];
const handles = () => readdirSync(`/proc/${service.child.pid}/fd`).length;
const logged = pattern => (service.log.match(pattern) ?? []).length;
async function page_bytes() {
  await browser.send('HeapProfiler.collectGarbage');
  return (await browser.send('Runtime.getHeapUsage')).usedSize;
}

const measures = [];
async function measure(minute) {
  const now = {minute, daemon: daemon_bytes(), page: await page_bytes(), handles: handles()};
  measures.push(now);
  console.log(`${minute} min: daemon ${(now.daemon / 1e6).toFixed(1)} MB, ${now.handles} handles, page ` +
    `${(now.page / 1e6).toFixed(1)} MB; ${logged(/was stopped by a fault/g)} faults, enabled ` +
    `${logged(/enabled by the page/g)} times; ${await state(browser)}`);
}

// --- The operator ---
let seenBroken = false;
let forward = false;
// A click that a busy machine delays is refused; the next call clicks again.
async function operate() {
  seenBroken ||= await brokenLinks(browser) > 0;
  const now = await state(browser);
  if (now.startsWith('Stopped by a fault')) {
    await click(browser, '#acknowledge');
    await pause(500);
  } else if (now === 'Drives off') {
    await click(browser, '#enable');
    await pause(500);
  } else if (await shown(browser, 'drive')) {
    forward = !forward;
    const button = `[data-drive="${forward ? 1 : -1} 0 0"]`;
    await point(browser, button, 'mousePressed');
    await pause(1000);
    await point(browser, button, 'mouseReleased');
  }
}

try {
  const [, url] = await service.find(/page: (http:\S+)/);
  const [, token] = await service.find(/#token=([0-9a-f]{32})/);
  const {complaints} = listen(browser);
  for (const domain of ['Page', 'Runtime', 'Log', 'HeapProfiler']) await browser.send(`${domain}.enable`);
  await open(browser, `${url}#token=${token}`, {width: 1400, height: 900});
  await until(() => shown(browser, 'enable'), Boolean);
  await browser.evaluate(() => {
    document.getElementById('mode').value = 'velocity';
    document.getElementById('mode').dispatchEvent(new Event('change'));
  });
  const port = Number(new URL(url).port);
  for (let i = 0; i < 8; ++i) view(port, i % 2 === 0);
  comeAndGo(port);

  const begin = Date.now();
  const elapsed_min = () => (Date.now() - begin) / 60_000;
  for (let next = 1; elapsed_min() < minutes; await pause(100)) {
    await operate();
    if (elapsed_min() >= next) await measure(next++);
  }
  await until(async () => {
    await operate();
    return state(browser);
  }, text => text.startsWith('velocity: running'));
  await measure(elapsed_min().toFixed(1));

  assert.ok(logged(/was stopped by a fault/g) > 0, 'no fault stopped the robot');
  assert.ok(seenBroken, 'the page never drew a broken link');
  assert.deepEqual(complaints.filter(text => !text.includes('GPU stall due to ReadPixels')), []);
  const early = measures.find(({minute}) => minute === kWarmUp_min);
  const last = measures.at(-1);
  if (early && last.minute > 2 * kWarmUp_min) {
    assert.ok(last.daemon - early.daemon < kGrowth_bytes, 'the memory of the daemon grows');
    assert.ok(last.page - early.page < kGrowth_bytes, 'the memory of the page grows');
    assert.ok(last.handles - early.handles < 20, 'the handles of the daemon grow');  // clients come and go
  } else {
    console.log(`too short to judge growth, which takes more than ${2 * kWarmUp_min} minutes`);
  }
} finally {
  service.child.kill('SIGTERM');
  code = await service.ended;
  console.log(service.log.match(/ended after \d+ cycles, \d+ overruns/)?.[0] ?? service.log.slice(-2000));
  sim.kill('SIGTERM');
  await browser.close();
}
assert.equal(code, 0, 'youbotd did not end well');
process.exit(0);  // the clients would go on
