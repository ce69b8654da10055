// A report in the browser: opens it and reads its requests, errors, texts and canvases.
import assert from 'node:assert/strict';
import {writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {pathToFileURL} from 'node:url';

// Two lists that grow as the page does something.
export function listen(page) {
  const complaints = [];
  const requests = [];
  page.listen((method, {entry, exceptionDetails, request, ...rest}) => {
    if (method === 'Runtime.exceptionThrown') complaints.push(exceptionDetails.exception?.description);
    if (method === 'Runtime.consoleAPICalled') complaints.push(JSON.stringify(rest.args));
    // Tests read the canvas often, which no page does.
    if (method === 'Log.entryAdded' && !entry.text.includes('willReadFrequently')) complaints.push(entry.text);
    if (method === 'Network.requestWillBeSent') requests.push(request.url);
  });
  return {complaints, requests};
}

// Waits for later effects, such as a redraw, by condition, never by time alone.
export async function until(look, enough) {
  for (const end = Date.now() + 300_000;;) {
    const seen = await look();
    if (enough(seen)) return seen;
    assert.ok(Date.now() < end, `waited in vain; last seen: ${JSON.stringify(seen)}`);
    await new Promise(resolve => setTimeout(resolve, 20));
  }
}

export function emulate(page, scheme) {
  return page.send('Emulation.setEmulatedMedia', {features: [{name: 'prefers-color-scheme', value: scheme}]});
}

export async function open(page, file, {width, scheme}) {
  for (const domain of ['Page', 'Runtime', 'Log', 'Network']) await page.send(`${domain}.enable`);
  await page.send('Emulation.setDeviceMetricsOverride', {width, height: 900, deviceScaleFactor: 1, mobile: false});
  await emulate(page, scheme);
  const {errorText} = await page.send('Page.navigate', {url: pathToFileURL(file).href});
  assert.equal(errorText, undefined);
  // Two frames after loading, all plots have their final size.
  await until(() => page.evaluate(() => document.readyState === 'complete' &&
    [...document.querySelectorAll('figure.plot')].every(figure => figure.plot)), Boolean);
  await page.evaluate(() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done))));
}

export async function photograph(page, file) {
  const {data} = await page.send('Page.captureScreenshot', {captureBeyondViewport: true});
  writeFileSync(file, Buffer.from(data, 'base64'));
}

// Runs the checks in order: each is a sentence and its condition. The first failure ends the test, with a screenshot
// of the page in `folder`.
export function checks(page, folder) {
  let passed = 0;
  return {
    async check(sentence, work) {
      try {
        await work();
      } catch (error) {
        await photograph(page, join(folder, 'failed.png')).catch(() => {});
        throw new Error(`not so: ${sentence} (see ${folder})`, {cause: error});
      }
      ++passed;
      console.log(`ok: ${sentence}`);
    },
    summary: () => `${passed} passed, 0 failed`,
  };
}

// --- functions for the page; self-contained, because only their text is sent ---

// The texts of the page: its title, and labels and contents of plots and tables.
export function read() {
  const text = node => node.textContent;
  return {
    title: document.title,
    width: {page: document.documentElement.scrollWidth, window: document.documentElement.clientWidth},
    figures: [...document.querySelectorAll('figure.plot')].map(figure => ({
      caption: text(figure.querySelector('figcaption')),
      axes: ['.dygraph-xlabel', '.dygraph-ylabel'].map(label => text(figure.querySelector(label))),
      legend: [...figure.querySelectorAll('.legend button')].map(text),
      hint: text(figure.querySelector('.below p')),
    })),
    tables: [...document.querySelectorAll('main > .table table')].map(table => ({
      caption: table.caption?.textContent ?? '',
      numbers: [...table.querySelectorAll('td.number')].filter(cell => Number.isFinite(Number(text(cell)))).length,
      rows: [...table.tBodies[0].rows].map(row => [...row.cells].map(text)),
    })),
  };
}

// For each series with a line or markers: how many of its points in view, with the ends of
// error bars, have its colour nearby.
export function seriesOnCanvas(plot) {
  const figure = document.querySelectorAll('figure.plot')[plot];
  const {view, colourOf, toPixels} = figure.plot;
  const canvas = figure.querySelector('canvas');
  const {width, height} = canvas;
  const {data} = canvas.getContext('2d').getImageData(0, 0, width, height);
  const written = JSON.parse(figure.querySelector('script').textContent);
  const within = (value, [from, to]) => value !== null && value >= from && value <= to;
  return written.series.flatMap((series, index) => {
    if (!series.y) return [];
    const colour = colourOf(index).match(/[0-9a-f]{2}/gi).map(hex => parseInt(hex, 16));
    const reach = series.style === 'dashed' ? 6 : 3;  // a point may lie between two dashes
    const near = (left, top) => {
      for (let y = top - reach; y <= top + reach; ++y) {
        for (let x = left - reach; x <= left + reach; ++x) {
          const i = 4 * (y * width + x);
          if (data[i + 3] > 200 && colour.every((part, k) => Math.abs(part - data[i + k]) < 40)) return true;
        }
      }
      return false;
    };
    let found = 0;
    let of = 0;
    const errorBars = series.style === 'points' && series.lower ? [series.lower, series.upper] : [];
    for (const values of [series.y, ...errorBars]) {
      series.x.forEach((x, k) => {
        if (!within(x, view.x) || !within(values[k], view.y)) return;
        ++of;
        found += near(...toPixels(x, values[k]).map(Math.round));
      });
    }
    return [{name: series.name, found, of}];
  });
}
