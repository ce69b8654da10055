// Records simulated runs and checks their reports in the browser, at the size of a desktop and of a phone:
//     node run_reports_test.mjs YOUBOTD FOLDER
// Leaves recordings, pages and screenshots in FOLDER.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync} from 'node:fs';
import {dirname, join} from 'node:path';
import {fileURLToPath, pathToFileURL} from 'node:url';

import {launch} from './chromium.mjs';
import {checks, listen, open, photograph, read, until} from './report_page.mjs';

const [program, folder] = process.argv.slice(2);
const configurations = join(dirname(fileURLToPath(import.meta.url)), '../../apps/youbotd');

rmSync(folder, {recursive: true, force: true});
mkdirSync(folder, {recursive: true});
// A base without friction compensation never starts, and is stopped when its reference is too far ahead.
writeFileSync(join(folder, 'fault.toml'), '[compensation]\nenabled = false\n[[path.leg]]\nforward_m = 1\n');
const kRuns = [
  {name: 'teleoperation', words: ['--config', join(configurations, 'teleop.toml'), '--demo'], exit: 0,
    title: /^Teleoperation of \d+\.\d s: up to \d\.\d\d N on the hand, end effector within \d+ mm of its set-point$/,
    sections: ['Summary', 'Tasks of the simulated operator', 'Performance', 'Path', 'Forces and energy', 'Joints', 'Limits touched', 'Phases',
      'Cycle times']},
  {name: 'path', words: ['--config', join(configurations, 'demo.toml')], exit: 0,
    title: /^Base run \(path\) of \d+\.\d s: \d+\.\d mm rms from the reference, \d+\.\d mm at worst$/,
    sections: ['Summary', 'Path', 'Motion and forces', 'Limits touched', 'Phases', 'Cycle times']},
  {name: 'fault', words: ['--config', join(folder, 'fault.toml')], exit: 4, title: /, stopped by a fault$/,
    sections: ['Fault', 'Summary', 'Path', 'Motion and forces', 'Limits touched', 'Phases', 'Cycle times']},
];
for (const {name, words, exit} of kRuns) {
  const {status} = spawnSync(program, [...words, '--virtual-time', '--quiet', '--record', join(folder, name)], {stdio: 'ignore'});
  assert.equal(status, exit, name);
}

const page = await launch();
const {complaints, requests} = listen(page);
const checked = checks(page, folder);
const fileOf = name => join(folder, name, 'report.html');
try {
  for (const {name, title, sections} of kRuns) {
    const check = (what, work) => checked.check(`the report of ${name} ${what}`, work);
    await check('has a title that says how it went, and links to its sections', async () => {
      await open(page, fileOf(name), {width: 1400, scheme: 'light'});
      assert.match((await page.evaluate(read)).title, title);
      assert.deepEqual(await page.evaluate(() => [...document.querySelectorAll('nav a')].map(link =>
        document.querySelector(link.getAttribute('href')).textContent)), sections);
      await photograph(page, join(folder, `${name}_desktop.png`));
    });

    await check('names axes with units, and has values in every plot', async () => {
      const {figures, tables} = await page.evaluate(read);
      for (const {caption, axes, legend, hint} of figures) {
        for (const axis of axes) assert.match(axis, /\(.+\)$/, caption);
        assert.ok(legend.length > 0 && legend.every(Boolean), caption);
        assert.equal(hint, 'Drag to zoom in, point to read values.', caption);
      }
      for (const cell of tables.flatMap(table => table.rows.flat())) {
        assert.doesNotMatch(cell, /nan|inf\b|undefined|null/i);
        assert.notEqual(cell, '', 'no cell is without contents');
      }
    });

    await check('draws the path with a metre as long in x as in y', async () => {
      for (const caption of name === 'teleoperation' ? ['From above', 'From the right side'] : ['From above']) {
        const [[x0, y0], [x1, y1]] = await page.evaluate(title => {
          const figure = [...document.querySelectorAll('figure.plot')].find(one =>
            one.querySelector('figcaption').textContent === title);
          return [figure.plot.toPixels(0, 0), figure.plot.toPixels(1, 1)];
        }, caption);
        assert.ok(Math.abs((x1 - x0) - (y0 - y1)) < 1, `${caption}: ${x1 - x0} by ${y0 - y1} pixels`);
      }
    });

    await check('links all plots over time, and marks the phases in them', async () => {
      const plots = await page.evaluate(() => [...document.querySelectorAll('figure.plot')].map(figure => {
        const plot = JSON.parse(figure.querySelector('script').textContent);
        return {title: plot.title, label: plot.x.label, link: plot.x.link, spans: plot.spans.map(span => span.name), view: figure.plot.view.x};
      }));
      const overTime = plots.filter(({label}) => label === 'time');
      assert.ok(overTime.length >= 9);
      for (const {title, link, spans, view} of overTime) {
        assert.equal(link, 'time', title);
        assert.deepEqual(view, overTime[0].view, title);
        assert.ok(spans.length >= 2, title);
        assert.equal(spans.includes('fault'), name === 'fault', title);
      }
    });

    await check('fits a phone', async () => {
      await open(page, fileOf(name), {width: 390, scheme: 'dark'});
      const {width} = await page.evaluate(read);
      assert.ok(width.page <= width.window, `the page is ${width.page} pixels wide`);
      const hidden = await page.evaluate(() => [...document.querySelectorAll('main > .table')]
        .filter(box => box.scrollWidth > box.clientWidth + 1 && !getComputedStyle(box, '::before').content.includes('scroll'))
        .map(box => box.textContent));
      assert.deepEqual(hidden, []);
      await photograph(page, join(folder, `${name}_phone.png`));
    });

    await check('asks for nothing and complains about nothing', async () => {
      assert.deepEqual(requests.filter(url => !kRuns.some(run => url === pathToFileURL(fileOf(run.name)).href)), []);
      assert.deepEqual(complaints, []);
    });
  }

  await checked.check('the report of a fault gives its time and cause, and leads to the last second', async () => {
    await open(page, fileOf('fault'), {width: 1400, scheme: 'light'});
    const {tables} = await page.evaluate(read);
    const rows = Object.fromEntries(tables[0].rows);
    assert.match(rows.time, /^\d+\.\d{3} s$/);
    assert.match(rows.cause, /from its reference, more than allowed/);
    const csv = readdirSync(join(folder, 'fault')).find(file => /^youbotd-fault-.*\.csv$/.test(file));
    assert.equal(rows['the last second, each cycle'], csv);
    const lines = readFileSync(join(folder, 'fault', csv), 'utf8').trim().split('\n').filter(line => !line.startsWith('#'));
    const last = Number(lines.at(-1).split(',')[0]);
    assert.ok(last >= Number.parseFloat(rows.time) - 0.002, `${last} and ${rows.time}`);
  });

  await checked.check('the report of teleoperation reads all curves at one time, in all plots', async () => {
    await open(page, fileOf('teleoperation'), {width: 1400, scheme: 'light'});
    const place = await page.evaluate(() => {
      const figure = [...document.querySelectorAll('figure.plot')].find(one =>
        one.querySelector('figcaption').textContent === 'Force on the hand');
      const canvas = figure.querySelector('canvas');
      canvas.scrollIntoView({block: 'center'});
      const box = canvas.getBoundingClientRect();
      const [left, top] = figure.plot.toPixels(30, 0.5);
      return {x: box.left + left, y: box.top + top};
    });
    await page.send('Input.dispatchMouseEvent', {type: 'mouseMoved', ...place});
    const titles = await until(() => page.evaluate(() => [...document.querySelectorAll('.tip')]
      .filter(tip => !tip.hidden).map(tip => tip.querySelector('p').textContent)), all => all.length >= 9);
    for (const title of titles) assert.match(title, /^time \d\d\.\d\d s, follow$/);
    await photograph(page, join(folder, 'hover.png'));
  });
} finally {
  await page.close();
}
console.log(checked.summary());
