// Runs the experiments for a few simulated seconds, identifies drives from one, then checks the resulting reports
// in the browser:
//     node experiment_reports_test.mjs YOUBOT_BENCH FOLDER
// Leaves recordings, pages and screenshots in FOLDER.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync, readFileSync, rmSync} from 'node:fs';
import {join} from 'node:path';
import {pathToFileURL} from 'node:url';

import {launch} from './chromium.mjs';
import {checks, emulate, listen, open, photograph, read, seriesOnCanvas, until} from './report_page.mjs';

const [bench, folder] = process.argv.slice(2);
const kWheels = ['wheel-1', 'wheel-2', 'wheel-3', 'wheel-4'];
const kDirections = ['forward', 'backward'];

// Each entry: the command, the expected title, and the expected axes of the plots.
const kReports = [
  {name: 'steady-state', options: '--sets 1,6,9 --settle 1 --measure 1 --extra 0',
    title: /^Friction of wheel-1 to wheel-4: 0\.0\d+ to 0\.\d+ N·m at speeds of 0\.\d+ to \S+ rad\/s$/,
    axes: ['velocity (rad/s)', 'friction torque (N·m)', 'half the 95 % interval (N·m)']},
  {name: 'torque-ramp', options: '--repeats 1 --rate 0.02 --rest 1',
    title: /^Torque ramp: wheel-1 to wheel-4 break away at 0\.0\d+ to 0\.\d+ N·m$/,
    axes: ['time since the ramp began (s)', 'torque, measured (N·m)', 'torque, commanded (N·m)', 'displacement (rad)']},
  {name: 'dahl', options: '--cycles 3 --frequency 0.5 --rest 1',
    title: /^Dahl's loop: pre-sliding stiffness of wheel-1 to wheel-4 is \d+( to \d+)? N·m\/rad$/,
    axes: ['displacement (rad)', 'torque (N·m)']},
  {name: 'presliding', options: '--periods 1 --period 4 --lowest 0.25 --rest 1',
    title: /^Pre-sliding: wheel-1 to wheel-4 moved by .* rad at most and came back$/,
    axes: ['time (s)', 'torque (N·m)', 'displacement (rad)']},
  {name: 'stick-slip', options: '--duration 12 --rest 1', title: /^Stick-slip: wheel-1.* stick and slip/,
    axes: ['time since the pull began (s)', 'velocity (rad/s)', 'torque, commanded (N·m)']},
  {name: 'compensation', options: '--duration 8 --rest 1',
    title: /^Friction compensation: \d+( to \d+)? swings after a push, without it \d+/,
    axes: ['time since the push (s)', 'displacement (rad)']},
  {name: 'staircase', options: '--hold 0.3',
    title: /^Staircase of torque up to 0\.14 N·m: wheel-1 to wheel-4 reached/,
    axes: ['time (s)', 'torque (N·m)', 'velocity (rad/s)', 'displacement (rad)']},
  {name: 'multisine', options: '--periods 1 --period 4 --lowest 0.25 --rest 1',
    title: /^Multisine of torque up to 0\.3 N·m: wheel-1 to wheel-4 reached/,
    axes: ['time (s)', 'torque (N·m)', 'velocity (rad/s)', 'displacement (rad)']},
  {name: 'identify', title: /^Drive model of wheel-1 to wheel-4: Coulomb friction .* N·m, viscous .* N·m·s\/rad/,
    axes: ['velocity (rad/s)', 'friction torque (N·m)', 'torque (N·m)']},
];

rmSync(folder, {recursive: true, force: true});
mkdirSync(folder, {recursive: true});
const run = (...words) => execFileSync(bench, words, {stdio: ['ignore', 'ignore', 'inherit']});
for (const {name, options} of kReports) {
  if (options) run(name, '--quiet', '--out', join(folder, name), ...options.split(' '));
  else run(name, '--map', join(folder, 'steady-state'), '--out', join(folder, name));
}

const page = await launch();
const {complaints, requests} = listen(page);
const checked = checks(page, folder);
const check = (name, what, work) => checked.check(`the report of ${name} ${what}`, work);
try {
  for (const {name, title, axes} of kReports) {
    const file = join(folder, name, 'report.html');
    await check(name, 'has a title that says what was found, plots with units, and tables with numbers', async () => {
      requests.length = 0;
      await open(page, file, {width: 1200, scheme: 'light'});
      const seen = await page.evaluate(read);
      assert.match(seen.title, title);
      assert.ok(seen.figures.length >= 2);
      assert.deepEqual([...new Set(seen.figures.flatMap(figure => figure.axes))].sort(), [...axes].sort());
      for (const {caption, legend, hint} of seen.figures) {
        assert.ok(legend.every(Boolean) && legend.length > 0, `"${caption}" has a legend`);
        assert.equal(hint, 'Drag to zoom in, point to read values.', `"${caption}" has values`);
      }
      assert.ok(seen.tables.length >= 1);
      for (const table of seen.tables) {
        assert.ok(table.rows.length > 0, table.caption);
        for (const cell of table.rows.flat()) assert.doesNotMatch(cell, /nan|inf|undefined|null/i, table.caption);
      }
      assert.ok(seen.tables[0].numbers >= 12, `${seen.tables[0].numbers} numbers in "${seen.tables[0].caption}"`);
    });

    for (const scheme of ['light', 'dark']) {
      await check(name, `is drawn in ${scheme} colours`, async () => {
        await emulate(page, scheme);
        await until(() => page.evaluate(() => getComputedStyle(document.body).backgroundColor),
          colour => (colour === 'rgb(255, 255, 255)') === (scheme === 'light'));
        const count = await page.evaluate(() => document.querySelectorAll('figure.plot').length);
        for (let plot = 0; plot < count; ++plot) {
          // One at a time: curves of wheels cover each other where they are equal.
          const all = await page.evaluate(seriesOnCanvas, plot);
          for (let index = 0; index < all.length; ++index) {
            await page.evaluate(showOnly, plot, index);
            const {name: which, found, of} = (await page.evaluate(seriesOnCanvas, plot))[index];
            assert.ok(of > 0 && found >= 0.9 * of, `plot ${plot}, "${which}": ${found} of ${of} have its colour`);
          }
          await page.evaluate(showOnly, plot, null);
        }
        await photograph(page, join(folder, `${name}_${scheme}.png`));
      });
    }

    await check(name, 'asks for nothing and complains about nothing', async () => {
      assert.deepEqual(requests, [pathToFileURL(file).href]);
      assert.deepEqual(complaints, []);
    });
  }

  await check('torque-ramp', 'gives the break-away of the result files', async () => {
    await open(page, join(folder, 'torque-ramp', 'report.html'), {width: 400, scheme: 'light'});
    const {tables, width} = await page.evaluate(read);
    assert.ok(width.page <= width.window, `the page is ${width.page} pixels wide in a window of ${width.window}`);
    for (const wheel of kWheels) {
      const lines = readFileSync(join(folder, 'torque-ramp', 'torque-ramp-result', `${wheel}.csv`), 'utf8')
        .trim().split('\n').filter(line => !line.startsWith('#')).map(line => line.split(','));
      const column = lines[0].indexOf('breakaway_command_Nm');
      kDirections.forEach((direction, i) => {
        const row = tables[0].rows.find(cells => cells[0] === wheel && cells[1] === direction);
        const value = Number(lines[1 + i][column]);
        assert.ok(Math.abs(Number(row[3]) - value) < 5e-4 * Math.abs(value), `${wheel} ${direction}: ${row[3]}, not ${value}`);
      });
    }
  });

  await check('identify', 'has each parameter within its interval, and a model file for each wheel', async () => {
    await open(page, join(folder, 'identify', 'report.html'), {width: 1200, scheme: 'light'});
    const {tables} = await page.evaluate(read);
    const {rows} = tables.find(table => table.caption === 'Parameters with their 95 % intervals');
    for (const wheel of kWheels) {
      const fitted = rows.filter(cells => cells[0] === wheel && cells[6] === '');
      assert.ok(fitted.length >= 3, `${wheel}: ${fitted.length} parameters`);
      for (const [, parameter, value, from, to, unit] of fitted) {
        const inside = Number(from) <= Number(value) && Number(value) <= Number(to) && Number(from) < Number(to);
        assert.ok(inside, `${wheel}, ${parameter}: ${from} ${value} ${to}`);
        assert.match(unit, /^(N·m|rad)/, parameter);
      }
      const model = readFileSync(join(folder, 'identify', wheel, 'model.toml'), 'utf8');
      assert.ok(model.includes(`name = "${wheel}"`));
    }
  });
} finally {
  await page.close();
}
console.log(checked.summary());

// --- functions for the page; self-contained, because only their text is sent ---

// One series of a plot, or all without a number; drawn when this returns.
function showOnly(plot, only) {
  const {isOn, show} = document.querySelectorAll('figure.plot')[plot].plot;
  isOn.forEach((_, index) => { isOn[index] = only === null || index === only; });
  show();
}
