// Opens a sample report from disk in Chromium and checks texts, interaction and pixels:
//     node report_test.mjs REPORT_SAMPLE FOLDER
// Leaves the page and screenshots in FOLDER.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync, statSync} from 'node:fs';
import {join} from 'node:path';
import {pathToFileURL} from 'node:url';

import {launch} from './chromium.mjs';
import {checks, emulate, listen, open, photograph, seriesOnCanvas, until} from './report_page.mjs';

const [sample, folder] = process.argv.slice(2);
const file = join(folder, 'report_sample.html');
mkdirSync(folder, {recursive: true});
execFileSync(sample, [file], {stdio: 'inherit'});

const kCurve = 0, kLoop = 1, kLog = 2, kLarge = 3, kGap = 4, kSeven = 5, kEmpty = 6,
  kRamps = 8, kEqual = 9, kHalf = 10, kCircle = 11;  // plots, in the order of the page
const page = await launch();
const {complaints, requests} = listen(page);
const checked = checks(page, folder);
const check = (what, work) => checked.check(`a report ${what}`, work);
try {
  await show({width: 1200, scheme: 'light'});

  await check('is one small file that asks for nothing and complains about nothing', async () => {
    assert.deepEqual(requests, [pathToFileURL(file).href]);
    assert.deepEqual(complaints, []);
    const data = await page.evaluate(() => [...document.querySelectorAll('figure script')]
      .reduce((bytes, script) => bytes + script.textContent.length, 0));
    assert.ok(statSync(file).size - data < 200_000, 'without its data, a page is dygraphs (131 kB) and not much more');
  });

  await check('shows text as it was given, and tables with numbers to the right', async () => {
    const seen = await page.evaluate(() => ({
      title: document.title,
      bold: document.querySelectorAll('b').length,
      paragraph: document.querySelectorAll('main > p')[1].textContent,
      figure: document.querySelectorAll('figcaption')[4].textContent,
      header: [...document.querySelectorAll('table')[1].querySelectorAll('th')].map(cell => cell.textContent),
      rows: [...document.querySelector('tbody').rows].map(row => [...row.cells].map(cell => cell.textContent)),
      aligned: [...document.querySelector('tbody').rows[0].cells].map(cell => getComputedStyle(cell).textAlign),
    }));
    assert.equal(seen.title, 'Friction of wheel-1 <sample>');
    assert.equal(seen.bold, 0);
    assert.equal(seen.paragraph, 'Values & units are text: <b>not bold</b>.');
    assert.equal(seen.figure, '</script><b>Escaped & "quoted"</b>');
    assert.deepEqual(seen.header, ['model', 'rms residual (mN·m)']);
    assert.deepEqual(seen.rows[0], ['Coulomb', '0.04500', 'N·m', '0.044 … 0.046', '40']);
    assert.deepEqual(seen.rows[3], ['bristle stiffness', '–', 'N·m/rad', 'not seen in this data', '0']);
    assert.deepEqual(seen.aligned, ['left', 'right', 'left', 'left', 'right']);
  });

  await check('draws every series in its colour where its points are', async () => {
    for (let plot = kCurve; plot <= kSeven; ++plot) {
      for (const {name, found, of} of await page.evaluate(seriesOnCanvas, plot)) {
        assert.ok(of > 0 && found >= 0.9 * of, `plot ${plot}, "${name}": ${found} of ${of} points have its colour`);
      }
    }
  });

  await check('draws a loop as a loop: two branches, and nothing inside', async () => {
    // At displacement 0 the ellipse passes torque ±0.06 sin(0.6).
    const height = 0.06 * Math.sin(0.6);
    assert.ok(await page.evaluate(hasColour, kLoop, 0, 0, height));
    assert.ok(await page.evaluate(hasColour, kLoop, 0, 0, -height));
    assert.ok(!await page.evaluate(hasColour, kLoop, 0, 0, 0.3 * height));
    assert.ok(!await page.evaluate(hasColour, kLoop, 0, 0, -0.3 * height));
  });

  await check('draws a band between its limits and not beyond', async () => {
    // Where the curve's markers are not, above and below the line; 0.0585 N·m is at its middle there.
    const middle = 0.045 + 0.0125 * 1.55;
    for (const y of [middle + 0.0035, middle - 0.0035]) assert.ok(await page.evaluate(isTinted, kCurve, 1.55, y));
    for (const y of [middle + 0.012, middle - 0.02]) assert.ok(!await page.evaluate(isTinted, kCurve, 1.55, y));
    assert.ok(await page.evaluate(isTinted, kGap, 2.4, 0.3));
    assert.ok(!await page.evaluate(isTinted, kGap, 2.4, 0.8));
  });

  await check('leaves a gap where a value is missing', async () => {
    assert.ok(await page.evaluate(hasColour, kGap, 0, 0.5, 1));
    assert.ok(!await page.evaluate(hasColour, kGap, 0, 2, 2));
    assert.ok(await page.evaluate(hasColour, kGap, 0, 3.5, 1));
  });

  await check('draws one point, and says where there is none', async () => {
    const [point] = await page.evaluate(seriesOnCanvas, kEmpty + 1);
    assert.deepEqual(point, {name: 'once', found: 1, of: 1});
    assert.equal(await page.evaluate(readoutOf, kEmpty), 'No values to show.');
  });

  await check('has logarithmic axes, without what they cannot show', async () => {
    const {off, texts} = await page.evaluate(plot => {
      const figure = document.querySelectorAll('figure.plot')[plot];
      const places = [[0.1, 0.1], [10, 1], [1000, 10]].map(([x, y]) => figure.plot.toPixels(x, y));
      const off = i => Math.abs((places[0][i] + places[2][i]) / 2 - places[1][i]);
      const labels = [...figure.querySelectorAll('.dygraph-axis-label-x')];
      const {left: start} = figure.querySelector('canvas').getBoundingClientRect();
      const misplaced = labels.map(label => {
        const {left, width} = label.getBoundingClientRect();
        return Math.abs(left + width / 2 - start - figure.plot.toPixels(Number(label.textContent), 1)[0]);
      });
      return {off: Math.max(off(0), off(1), ...misplaced), texts: labels.map(label => label.textContent)};
    }, kLog);
    assert.ok(off < 0.5, `${off} pixels`);
    assert.deepEqual(texts, ['0.1', '1', '10', '100', '1000']);
  });

  await check('thins out a long series, says so and keeps its outliers', async () => {
    const {count, extremes, said} = await page.evaluate(plot => {
      const figure = document.querySelectorAll('figure.plot')[plot];
      const {y} = JSON.parse(figure.querySelector('script').textContent).series[0];
      return {
        count: y.length,
        extremes: [Math.min(...y), Math.max(...y)],
        said: figure.querySelector('.thinned').textContent,
      };
    }, kLarge);
    assert.ok(count > 4000 && count <= 8000, `${count} points`);
    assert.deepEqual(extremes, [-5e-5, 5e-5]);
    assert.match(said, /of 1,000,000 points/);
  });

  await check('zooms where the mouse drags, and back by double click', async () => {
    const before = await page.evaluate(viewOf, kCurve);
    const image = await page.evaluate(imageOf, kCurve);
    await dragTo(kCurve, [0.25, 0.02], [1.25, 0.075]);
    const zoomed = await page.evaluate(viewOf, kCurve);
    [...zoomed.x, ...zoomed.y].forEach((seen, i) =>  // to a few pixels
      assert.ok(Math.abs(seen - [0.25, 1.25, 0.02, 0.075][i]) < [0.02, 0.02, 0.002, 0.002][i], JSON.stringify(zoomed)));
    assert.equal(zoomed.reset, true);
    for (const {name, found, of} of await page.evaluate(seriesOnCanvas, kCurve))
      assert.ok(found >= 0.9 * of, `zoomed, "${name}": ${found} of ${of}`);
    await screenshot('zoomed');
    const middle = await page.evaluate(placeOf, kCurve, 0.7, 0.05);
    for (const clickCount of [1, 2]) await press(middle, clickCount);
    assert.deepEqual(await page.evaluate(viewOf, kCurve), before);
    await until(async () => await page.evaluate(imageOf, kCurve) === image || 'something is left of the zoomed plot',
      seen => seen === true);
  });

  await check('reads values out at the pointer', async () => {
    const place = await page.evaluate(placeOf, kGap, 1, 2);
    await page.send('Input.dispatchMouseEvent', {type: 'mouseMoved', x: place.x + 3, y: place.y + 3});
    await until(() => page.evaluate(readoutOf, kGap), text => text === 'with gap: time 1.000 s, position 2.000 rad');
  });

  await check('can be read, zoomed and reset by keys alone', async () => {
    await page.evaluate(plot => document.querySelectorAll('figure.plot .chart')[plot].focus(), kGap);
    await type('Home');
    await type('ArrowRight');
    assert.equal(await page.evaluate(readoutOf, kGap), 'with gap: time 1.000 s, position 2.000 rad');
    await type('ArrowRight');  // over the gap
    assert.equal(await page.evaluate(readoutOf, kGap), 'with gap: time 3.000 s, position 2.000 rad');
    await type('ArrowDown');
    assert.equal(await page.evaluate(readoutOf, kGap), 'expected: time 0.000 s, -0.5000 to 0.5000 rad');
    await type('+');
    assert.equal((await page.evaluate(viewOf, kGap)).reset, true);
    await type('-');
    await type('-');  // no further out than the whole
    assert.equal((await page.evaluate(viewOf, kGap)).reset, false);
    await type('+');
    await type('Escape');
    assert.deepEqual(await page.evaluate(viewOf, kGap), {x: [0, 4], y: [-1, 3], reset: false});
    const label = await page.evaluate(plot =>
      document.querySelectorAll('figure.plot .chart')[plot].getAttribute('aria-label'), kGap);
    assert.match(label, /position \(rad\) over time \(s\)\. with gap: 5 points, x 0\.000 to 4\.000/);
  });

  await check('says when, where and by which version it was made', async () => {
    assert.match(await page.evaluate(() => document.querySelector('header p').textContent),
      /^Made \d{4}-\d\d-\d\d \d\d:\d\d:\d\d UTC on \S+ by youbot-hal \d+\.\d+\.\d+ \(.+\)$/);
  });

  await check('has contents whose links lead to their sections', async () => {
    const texts = await page.evaluate(() => [...document.querySelectorAll('nav a')].map(link => link.textContent));
    assert.deepEqual(texts, ['Parameters', 'Curves', 'Linked']);
    const {text, top} = await page.evaluate(() => {
      document.querySelectorAll('nav a')[2].click();
      const target = document.querySelector(':target');
      return {text: target.textContent, top: target.getBoundingClientRect().top};
    });
    assert.equal(text, 'Linked');
    assert.ok(top >= 0 && top < 900, `${top}`);
    await page.evaluate(() => history.replaceState(null, '', location.pathname));
  });

  await check('links to files beside it', async () => {
    assert.deepEqual(await page.evaluate(() => {
      const link = document.querySelector('td a');
      return [link.textContent, link.getAttribute('href')];
    }), ['the <sample>', 'report_sample.html']);
  });

  await check('shows the values of all curves at the pointer, in all linked plots', async () => {
    await moveTo(kRamps, 4, 8);
    const [ramps, equal, half] = await until(() => page.evaluate(plots => plots.map(plot => {
      const tip = document.querySelectorAll('figure.plot')[plot].querySelector('.tip');
      return tip.hidden ? null : [...tip.querySelectorAll('p')].map(line => line.textContent);
    }), [kRamps, kEqual, kHalf]), seen => seen.every(Boolean));
    const number = text => Number(text.match(/-?[\d.]+(?= )/)[0]);
    assert.match(ramps[0], /^time \d\.\d+ s, running$/);
    const time = number(ramps[0]);
    assert.ok(Math.abs(time - 4) < 0.05, ramps[0]);
    for (const [line, name, value] of [[ramps[1], 'single', time], [ramps[2], 'double', 2 * time],
      [equal[1], 'wheel-1', 1 + 0.2 * time], [equal[2], 'wheel-2', 1 + 0.2 * time]]) {
      assert.ok(line.startsWith(name), line);
      assert.ok(Math.abs(number(line.slice(name.length)) - value) < 0.002 * value, `${line}, not ${value}`);
    }
    assert.equal(equal[0], ramps[0]);
    assert.match(half[1], /^robot\d\.\d+×10⁻⁷ m\/s$/);
    await moveTo(kRamps, 9, 8);
    await until(() => page.evaluate(plot => document.querySelectorAll('figure.plot')[plot].querySelector('.tip p:nth-child(2)'), kHalf),
      line => line === null);  // it has no value there
  });

  await check('zooms linked plots together, and back', async () => {
    const before = await page.evaluate(viewOf, kHalf);
    assert.deepEqual(before.x, (await page.evaluate(viewOf, kRamps)).x, 'linked plots begin with the same range');
    await dragTo(kRamps, [3, 1], [7, 1.1]);
    const [ramps, half] = [await page.evaluate(viewOf, kRamps), await page.evaluate(viewOf, kHalf)];
    assert.ok(Math.abs(ramps.x[0] - 3) < 0.1 && Math.abs(ramps.x[1] - 7) < 0.1, `${ramps.x}`);
    assert.deepEqual(half, {x: ramps.x, y: before.y, reset: true});
    await page.evaluate(plot => document.querySelectorAll('figure.plot .chart')[plot].focus(), kRamps);
    await type('Escape');
    assert.deepEqual(await page.evaluate(viewOf, kHalf), before);
  });

  await check('shows both of two equal lines', async () => {
    const shares = await page.evaluate((plot, [from, to]) => {
      const figure = document.querySelectorAll('figure.plot')[plot];
      const context = figure.querySelector('canvas').getContext('2d');
      const colours = [0, 1].map(index => figure.plot.colourOf(index).match(/[0-9a-f]{2}/gi).map(hex => parseInt(hex, 16)));
      const counts = [0, 0];
      for (let i = 0; i < 200; ++i) {
        const x = from + (to - from) * i / 199;
        const [left, top] = figure.plot.toPixels(x, 1 + 0.2 * x).map(Math.round);
        const {data} = context.getImageData(left, top, 1, 1);
        colours.forEach((colour, k) => { counts[k] += colour.every((part, c) => Math.abs(part - data[c]) < 60); });
      }
      return counts.map(count => count / 200);
    }, kEqual, [1, 9]);
    for (const share of shares) assert.ok(share > 0.25, `${shares}`);
  });

  await check('draws a circle as a circle, zoomed too', async () => {
    const isRound = async () => {
      const [[left, bottom], [right, top]] = await page.evaluate(plot => {
        const {toPixels} = document.querySelectorAll('figure.plot')[plot].plot;
        return [toPixels(-0.4, -0.4), toPixels(0.4, 0.4)];
      }, kCircle);
      assert.ok(Math.abs((right - left) - (bottom - top)) < 1, `${right - left} by ${bottom - top} pixels`);
      return right - left;
    };
    const before = await isRound();
    await dragTo(kCircle, [0, 0.1], [0.3, 0.3]);
    assert.ok(await isRound() > 1.5 * before);
    await page.evaluate(plot => document.querySelectorAll('figure.plot .chart')[plot].focus(), kCircle);
    await type('Escape');
  });

  await check('marks spans with their names', async () => {
    const label = await page.evaluate(plot =>
      document.querySelectorAll('figure.plot .chart')[plot].getAttribute('aria-label'), kRamps);
    assert.match(label, /Marked: starting 0\.000 to 2\.000, running .*, fault at 8\.000\./);
    const shades = await page.evaluate(plot => {
      const figure = document.querySelectorAll('figure.plot')[plot];
      const context = figure.querySelector('canvas').getContext('2d');
      return [1, 5, 9].map(x => {
        const [left, top] = figure.plot.toPixels(x, 19);
        return context.getImageData(Math.round(left) - 3, Math.round(top) + 12, 1, 1).data[3];
      });
    }, kRamps);
    assert.deepEqual(shades.map(alpha => alpha > 0), [true, false, true], `${shades}`);
  });

  await check('cuts off no number of an axis', async () => {
    const cut = await page.evaluate(() => [...document.querySelectorAll('.chart')].flatMap(chart => {
      const box = chart.getBoundingClientRect();
      const pen = document.createRange();
      return [...chart.querySelectorAll('.dygraph-axis-label')].filter(label => {
        pen.selectNodeContents(label);
        const {left, right} = pen.getBoundingClientRect();
        return left < box.left - 0.5 || right > box.right + 0.5;
      }).map(label => label.textContent);
    }));
    assert.deepEqual(cut, []);
  });

  await check('lets the last of an odd number of plots fill its row', async () => {
    const [row, last] = await page.evaluate(plots => plots.map(plot =>
      document.querySelectorAll('figure.plot')[plot].clientWidth), [kEqual, kHalf]);
    assert.ok(last > 1.9 * row, `${last} and ${row}`);
  });

  await check('hides and shows a series from the legend', async () => {
    const click = plot => document.querySelectorAll('figure.plot')[plot].querySelector('.legend button').click();
    await page.evaluate(click, kLoop);
    await until(() => page.evaluate(seriesOnCanvas, kLoop), ([loop]) => loop.found === 0);
    await page.evaluate(click, kLoop);
    await until(() => page.evaluate(seriesOnCanvas, kLoop), ([loop]) => loop.found === loop.of);
  });

  await check('gives the data of a plot as tables and as CSV', async () => {
    const open = async plot => {
      await page.evaluate(number => {
        document.querySelectorAll('figure.plot')[number].querySelector('details').open = true;
      }, plot);
      return until(() => page.evaluate(number => {
        const details = document.querySelectorAll('figure.plot')[number].querySelector('details');
        const link = details.querySelector('a');
        return link && {
          name: link.download,
          csv: decodeURIComponent(link.href.replace(/^data:text\/csv;charset=utf-8,/, '')),
          rows: [...details.querySelectorAll('tbody')].map(body => body.rows.length),
        };
      }, plot), Boolean);
    };
    const gap = await open(kGap);
    assert.equal(gap.name, 'script-b-Escaped-quoted-b.csv');
    assert.deepEqual(gap.csv.split('\r\n').slice(0, 4), [
      '"series","time (s)","position (rad)","lower (rad)","upper (rad)"', '"with gap",0,0,,', '"with gap",1,2,,',
      '"with gap",2,,,']);
    assert.deepEqual(gap.rows, [5, 2]);
    const large = await open(kLarge);
    assert.deepEqual(large.rows, [200]);
    assert.ok(large.csv.split('\r\n').length > 4000);
  });
  await screenshot('light');

  await check('follows a change to dark, on the canvas too', async () => {
    await emulate(page, 'dark');
    const dark = await until(() => page.evaluate(seriesOnCanvas, kLoop), ([loop]) => loop.found === loop.of);
    assert.ok(dark);
    assert.ok(await page.evaluate(() => {
      const [r, g, b] = getComputedStyle(document.body).backgroundColor.match(/\d+/g).map(Number);
      return r + g + b < 150;
    }));
    await screenshot('dark');
  });

  await check('is printed light and as wide as paper, whatever the screen', async () => {
    const widthOf = plot => document.querySelectorAll('figure.plot')[plot].querySelector('canvas').clientWidth;
    await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
    assert.equal(await page.evaluate(() =>
      getComputedStyle(document.body).backgroundColor), 'rgb(255, 255, 255)');
    assert.ok(await page.evaluate(widthOf, kCurve) <= 640);
    await until(() => page.evaluate(seriesOnCanvas, kLoop), ([loop]) => loop.found === loop.of);
    await page.evaluate(() => dispatchEvent(new Event('afterprint')));
    await until(() => page.evaluate(widthOf, kCurve), width => width > 1000);
  });

  await check('fits a window of 400 pixels', async () => {
    await show({width: 400, scheme: 'light'});
    const {page: pageWidth, window, charts} = await page.evaluate(() => ({
      page: document.documentElement.scrollWidth,
      window: document.documentElement.clientWidth,
      charts: [...document.querySelectorAll('.chart')].map(chart =>
        chart.clientWidth - chart.querySelector('canvas').clientWidth),
    }));
    assert.ok(pageWidth <= window, `the page is ${pageWidth} pixels wide`);
    for (const spare of charts) assert.ok(spare >= 0);
    const tables = await page.evaluate(() => [...document.querySelectorAll('main > .table')].map(box => ({
      isWider: box.scrollWidth > box.clientWidth + 1,
      hint: getComputedStyle(box, '::before').content.includes('scroll sideways'),
    })));
    assert.ok(tables.some(({isWider}) => isWider));
    for (const {isWider, hint} of tables) assert.equal(hint, isWider);
    for (const {name, found, of} of await page.evaluate(seriesOnCanvas, kLoop)) assert.equal(found, of, name);
    await screenshot('narrow');
  });

  await check('still asks for nothing and complains about nothing', async () => {
    assert.deepEqual(requests.filter(url => url !== pathToFileURL(file).href && !url.startsWith('data:')), []);
    assert.deepEqual(complaints, []);
  });
} finally {
  await page.close();
}
console.log(checked.summary());

async function show(how) {
  requests.length = 0;
  await open(page, file, how);
}

function screenshot(name) {
  return photograph(page, join(folder, `report_${name}.png`));
}

async function press({x, y}, clickCount) {
  for (const type of ['mousePressed', 'mouseReleased'])
    await page.send('Input.dispatchMouseEvent', {type, x, y, button: 'left', clickCount});
}

async function moveTo(plot, x, y) {
  await page.send('Input.dispatchMouseEvent', {type: 'mouseMoved', ...await page.evaluate(placeOf, plot, x, y)});
}

async function dragTo(plot, from, to) {
  const [a, b] = [await page.evaluate(placeOf, plot, ...from), await page.evaluate(placeOf, plot, ...to)];
  const mouse = (type, {x, y}) =>
    page.send('Input.dispatchMouseEvent', {type, x, y, button: 'left', buttons: 1, clickCount: 1});
  await page.send('Input.dispatchMouseEvent', {type: 'mouseMoved', ...a});
  await mouse('mousePressed', a);
  for (const share of [0.3, 0.6, 1])
    await mouse('mouseMoved', {x: a.x + (b.x - a.x) * share, y: a.y + (b.y - a.y) * share});
  await mouse('mouseReleased', b);
  await until(() => page.evaluate(viewOf, plot), ({reset}) => reset);
}

async function type(key) {
  const text = key.length === 1 ? key : undefined;
  await page.send('Input.dispatchKeyEvent', {type: 'keyDown', key, text});
  await page.send('Input.dispatchKeyEvent', {type: 'keyUp', key});
}

// --- functions for the page; self-contained, because only their text is sent ---

// Position of a value in the window; scrolls there first.
function placeOf(plot, x, y) {
  const figure = document.querySelectorAll('figure.plot')[plot];
  const canvas = figure.querySelector('canvas');
  canvas.scrollIntoView({block: 'center'});
  const box = canvas.getBoundingClientRect();
  const [left, top] = figure.plot.toPixels(x, y);
  return {x: box.left + left, y: box.top + top};
}

function viewOf(plot) {
  const figure = document.querySelectorAll('figure.plot')[plot];
  return {...figure.plot.view, reset: !figure.querySelector('.below button').hidden};
}

function imageOf(plot) {
  return document.querySelectorAll('figure.plot')[plot].querySelector('canvas').toDataURL();
}

function readoutOf(plot) {
  return document.querySelectorAll('figure.plot')[plot].querySelector('.below p').textContent;
}

// Whether a series' colour is within two pixels of a value.
function hasColour(plot, series, x, y) {
  const figure = document.querySelectorAll('figure.plot')[plot];
  const colour = figure.plot.colourOf(series).match(/[0-9a-f]{2}/gi).map(hex => parseInt(hex, 16));
  const [left, top] = figure.plot.toPixels(x, y).map(Math.round);
  const {data} = figure.querySelector('canvas').getContext('2d').getImageData(left - 2, top - 2, 5, 5);
  for (let i = 0; i < data.length; i += 4) {
    if (data[i + 3] > 200 && colour.every((part, k) => Math.abs(part - data[i + k]) < 40)) return true;
  }
  return false;
}

// Whether the pixel, which must not be one of the grid, has the colour of the second series and is transparent.
function isTinted(plot, x, y) {
  const figure = document.querySelectorAll('figure.plot')[plot];
  const [left, top] = figure.plot.toPixels(x, y).map(Math.round);
  const [r, g, b, alpha] = figure.querySelector('canvas').getContext('2d').getImageData(left, top, 1, 1).data;
  return alpha > 20 && alpha < 150 && r > b + 60 && r > g;
}
