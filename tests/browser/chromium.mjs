// Headless Chromium, controlled over its debugging pipe: JSON messages, each terminated by a zero byte.
import {spawn} from 'node:child_process';
import {existsSync, mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

const kPatience_ms = 300_000;  // for one answer; a starved machine is slow, a dead browser never answers

function find() {
  const places = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];
  const found = places.find(place => place && existsSync(place));
  if (!found) throw new Error('no browser: install chromium (./dev test does), or name one in CHROMIUM');
  return found;
}

export async function launch() {
  const program = find();
  const profile = mkdtempSync(join(tmpdir(), 'browser-test-'));
  // Without the sandbox, which root cannot use: it only opens our own page. Without name resolution, so that network
  // requests of the page are visible and stay local. Without scroll bars: the browser hides them for a screenshot of
  // the whole page, which widens every plot, and restores them at an unpredictable time.
  const browser = spawn(program, [
    '--headless=new', '--no-sandbox', '--disable-gpu', '--enable-unsafe-swiftshader', '--disable-dev-shm-usage', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync', '--disable-extensions',
    '--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1', '--hide-scrollbars', '--force-device-scale-factor=1', '--remote-debugging-pipe',
    `--user-data-dir=${profile}`, 'about:blank',
  ], {stdio: ['ignore', 'ignore', 'pipe', 'pipe', 'pipe']});

  const waiting = new Map();
  const listeners = [];
  let failure = null;
  let last = 0;
  const fail = reason => {
    failure ??= new Error(`chromium: ${reason}`);
    for (const {reject} of waiting.values()) reject(failure);
    waiting.clear();
  };
  browser.on('error', error => fail(error.message));
  let said = '';
  browser.stdio[2].setEncoding('utf8').on('data', chunk => {
    said = (said + chunk).slice(-2000);
  });
  browser.on('exit', code => fail(`ended with ${code}. ${said}`));
  browser.stdio[3].on('error', () => {});  // reported by exit

  let rest = '';
  browser.stdio[4].setEncoding('utf8').on('data', chunk => {
    const messages = (rest + chunk).split('\0');
    rest = messages.pop();
    for (const message of messages.map(text => JSON.parse(text))) {
      const asked = waiting.get(message.id);
      if (!asked) {
        if (message.method) for (const listener of listeners) listener(message.method, message.params);
        continue;
      }
      waiting.delete(message.id);
      if (message.error) asked.reject(new Error(`${asked.method}: ${message.error.message}`));
      else asked.resolve(message.result);
    }
  });

  function send(method, params = {}, sessionId = undefined) {
    if (failure) return Promise.reject(failure);
    const id = ++last;
    return new Promise((resolve, reject) => {
      const timer = setTimeout(() => fail(`no answer to ${method}`), kPatience_ms);
      const done = then => value => {
        clearTimeout(timer);
        then(value);
      };
      waiting.set(id, {method, resolve: done(resolve), reject: done(reject)});
      browser.stdio[3].write(`${JSON.stringify({id, method, params, sessionId})}\0`);
    });
  }

  try {
    const {targetId} = await send('Target.createTarget', {url: 'about:blank'});
    const {sessionId} = await send('Target.attachToTarget', {targetId, flatten: true});
    const page = (method, params) => send(method, params, sessionId);
    return {
      send: page,
      listen: listener => listeners.push(listener),
      // The result of the function in the page; the arguments are passed as JSON.
      async evaluate(work, ...values) {
        const expression = `(${work})(${values.map(value => JSON.stringify(value)).join(',')})`;
        const {result, exceptionDetails} = await page('Runtime.evaluate',
          {expression, awaitPromise: true, returnByValue: true});
        if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
        return result.value;
      },
      close,
    };
  } catch (error) {
    await close();
    throw error;
  }

  async function close() {
    const ended = new Promise(resolve => browser.once('exit', resolve));
    if (browser.pid && browser.exitCode === null && browser.signalCode === null) {
      const timer = setTimeout(() => browser.kill('SIGKILL'), 60_000);
      send('Browser.close').catch(() => {});  // its children end with it, which they do not when it is killed
      await ended;
      clearTimeout(timer);
    }
    try {
      rmSync(profile, {recursive: true, force: true, maxRetries: 10, retryDelay: 50});
    } catch (error) {
      console.error(`left behind: ${error.message}`);  // no reason for a test to fail
    }
  }
}
