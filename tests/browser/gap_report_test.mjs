// Records a simulated wheel with more friction than its model, has the gap explained, and checks the report in the
// browser:
//     node gap_report_test.mjs YOUBOT_GAP FOLDER
// Leaves recordings, page and screenshots in FOLDER.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {pathToFileURL} from 'node:url';

import {launch} from './chromium.mjs';
import {checks, emulate, listen, open, photograph, read, seriesOnCanvas, until} from './report_page.mjs';

const [program, folder] = process.argv.slice(2);

rmSync(folder, {recursive: true, force: true});
mkdirSync(folder, {recursive: true});
writeFileSync(join(folder, 'base.toml'), `format = "youbot-drive-model/1"
name = "wheel-1"
inertia_kg_m2 = 0.0112
[sensor]
encoder_ticks_per_rev = 104000
torque_noise_Nm = 0.0015
[[effect]]
type = "coulomb"
torque_Nm = 0.045
`);
for (const [index, name] of ['1.csv', '2.csv', 'held-out.csv'].entries())
  writeFileSync(join(folder, name), recording(index));
const words = ['--quiet', '--model', 'base.toml', '--data', '1.csv', '2.csv', '--held-out', 'held-out.csv', '--out', 'out'];
execFileSync(program, words, {cwd: folder, stdio: ['ignore', 'ignore', 'inherit']});
const gap = JSON.parse(readFileSync(join(folder, 'out', 'gap.json'), 'utf8'));

const page = await launch();
const {complaints, requests} = listen(page);
const file = join(folder, 'out', 'report.html');
const checked = checks(page, folder);
const check = (what, work) => checked.check(`the report of a gap ${what}`, work);
try {
  await open(page, file, {width: 1200, scheme: 'light'});
  const seen = await page.evaluate(read);

  await check('says in its title what was missing and how the gap fell', async () => {
    assert.match(seen.title, /^Gap of wheel-1: viscous.* was missing.* gap falls from 0\.0\d+ N·m to 0\.00\d+ N·m, noise is 0\.00\d+ N·m$/);
  });

  await check('has the numbers of gap.json in its tables', async () => {
    const table = caption => seen.tables.find(one => one.caption.startsWith(caption)).rows;
    const near = (text, value) => assert.ok(Math.abs(Number(text) - value) <= 1e-3 * Math.abs(value), `${text} for ${value}`);
    near(table('The gap, step by step').at(0)[2], gap.gap.before);
    near(table('The gap, step by step').at(-1)[2], gap.gap.after);
    const found = table('Effects found');
    assert.deepEqual(found.map(row => row[0]), gap.effects.map(({type}) => type.replaceAll('_', ' ')));
    const {value, ci95: [from, to]} = gap.effects[0].parameters.coefficient_Nm_s_per_rad;
    const [, name, shown, low, high, unit] = table('Their parameters')[0];
    assert.deepEqual([name, unit], ['coefficient', 'N·m·s/rad']);
    near(shown, value);
    near(low, from);
    near(high, to);
    assert.equal(table('Effects tried and rejected').length, gap.rejected.length);
    for (const cell of seen.tables.flatMap(one => one.rows.flat())) assert.doesNotMatch(cell, /nan|inf|undefined|null/i);
  });

  await check('has plots of what is left, of traces and of friction, with units and legends', async () => {
    const titles = seen.figures.map(figure => figure.caption);
    for (const title of ['The gap, step by step', 'Left over against velocity', 'Velocity in held-out.csv', 'Friction against velocity'])
      assert.ok(titles.some(one => one.startsWith(title)), `"${title}" in ${titles}`);
    for (const {caption, axes, legend, hint} of seen.figures) {
      for (const axis of axes.slice(caption.startsWith('The gap') ? 1 : 0)) assert.match(axis, /\(.+\)$/, caption);
      assert.ok(legend.length >= 2 && legend.every(Boolean), `"${caption}" has a legend`);
      assert.equal(hint, 'Drag to zoom in, point to read values.', `"${caption}" has values`);
    }
  });

  for (const scheme of ['light', 'dark']) {
    await check(`is drawn in ${scheme} colours`, async () => {
      await emulate(page, scheme);
      await until(() => page.evaluate(() =>
        getComputedStyle(document.body).backgroundColor), colour => (colour === 'rgb(255, 255, 255)') === (scheme === 'light'));
      for (let plot = 0; plot < seen.figures.length; ++plot) {
        // Equal curves show their colours in turn.
        const series = await until(() => page.evaluate(seriesOnCanvas, plot), all => all.at(-1).found >= 0.5 * all.at(-1).of);
        for (const {name, found, of} of series)
          assert.ok(of > 0 && found > 0, `"${seen.figures[plot].caption}", "${name}": ${found} of ${of} points have its colour`);
      }
      await photograph(page, join(folder, `report_${scheme}.png`));
    });
  }

  await check('fits a narrow window', async () => {
    await open(page, file, {width: 400, scheme: 'light'});
    const {width} = await page.evaluate(read);
    assert.ok(width.page <= width.window, `the page is ${width.page} pixels wide in a window of ${width.window}`);
  });

  await check('asks for nothing and complains about nothing', async () => {
    assert.deepEqual([...new Set(requests)], [pathToFileURL(file).href]);
    assert.deepEqual(complaints, []);
  });
} finally {
  await page.close();
}
console.log(checked.summary());

// Coulomb and viscous friction, driven by sines with a different phase in each recording.
function recording(index) {
  const period_s = 0.004;
  const step_s = period_s / 100;
  const inertia_kg_m2 = 0.0112;
  const tick_rad = 2 * Math.PI / 104000;
  let random = 1 + index;
  const uniform = () => (random = random * 48271 % 2147483647) / 2147483647;
  const noise_Nm = () => 0.0015 * Math.sqrt(-2 * Math.log(uniform())) * Math.cos(2 * Math.PI * uniform());
  const lines = ['# youbot recording v1', '# rig: wheel-1', '# experiment: multisine', '# sample_rate_Hz: 250',
    'time_s,torque_command_Nm,torque_measured_Nm,position_rad'];
  let torque_Nm = 0;
  let position_rad = 0;
  let velocity_rad_per_s = 0;
  for (let t = 0; t < 16; t += period_s) {
    const measured_Nm = torque_Nm + noise_Nm();  // what acted until now
    torque_Nm = 0.09 * Math.sin(2 * t + index) + 0.06 * Math.sin(5.3 * t + 2 * index) +
      0.04 * Math.sin(11.9 * t + 5 * index);
    lines.push([t, torque_Nm, measured_Nm, Math.round(position_rad / tick_rad) * tick_rad].join());
    for (let step = 0; step < 100; ++step) {
      const direction = Math.sign(velocity_rad_per_s || torque_Nm);
      const next = velocity_rad_per_s +
        step_s * (torque_Nm - 0.045 * direction - 0.0125 * velocity_rad_per_s) / inertia_kg_m2;
      // Friction brings it to rest; it never turns it round.
      velocity_rad_per_s = Math.abs(torque_Nm) < 0.045 && next * direction <= 0 ? 0 : next;
      position_rad += step_s * velocity_rad_per_s;
    }
  }
  return `${lines.join('\n')}\n`;
}
