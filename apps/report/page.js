// Draws each <figure class="plot"> from the JSON in it: uPlot does scales, axes and zoom; paths, legend,
// read-out, keys and the table of the data are here. uPlot's mode 2 gives each series its own x.
'use strict';
(() => {
  const kColours = 7;
  const kShapes = ['circle', 'square', 'triangle', 'diamond'];  // colour is never the only difference
  const kTableRows = 200;
  const kReach = 30;  // pixels from the pointer within which a point is read out
  const kPaperWidth = 640;
  const kFont = '12px system-ui, sans-serif';

  let isPrinting = false;

  // Colours come from the style sheet, which knows about light and dark; asked anew after a change.
  let colours = {};
  const css = name =>
    (colours[name] ??= getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  const colourName = look => `--series-${look % kColours}`;

  const element = (tag, attributes = {}, ...children) => {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  };
  const titled = axis => (axis.unit ? `${axis.label} (${axis.unit})` : axis.label);
  const hasMarkers = series => series.style.endsWith('points');
  const hasLine = series => series.style !== 'points' && series.y !== null;

  // --- numbers ---

  const superscript = number =>
    String(number).replace(/[-\d]/g, c => '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'['-0123456789'.indexOf(c)]);

  function decimalsOf(step) {
    let decimals = 0;
    while (decimals < 12 && Math.abs(step - Number(step.toFixed(decimals))) > step * 1e-6) ++decimals;
    return decimals;
  }

  // A power of ten is put aside where plain numbers would get long.
  function tickTexts(values, step) {
    const largest = Math.max(...values.map(Math.abs));
    const power = largest >= 1e6 || (largest > 0 && largest < 1e-3) ? Math.floor(Math.log10(largest)) : 0;
    const decimals = decimalsOf(step / 10 ** power);
    return values.map(value => {
      if (value === 0) return '0';
      const text = (value / 10 ** power).toFixed(decimals);
      return power === 0 ? text : `${text}×10${superscript(power)}`;
    });
  }

  function logTickText(value) {
    const power = Math.floor(Math.log10(value) + 1e-9);
    if (power >= -3 && power <= 4) return String(Number(value.toPrecision(3)));
    const factor = Number((value / 10 ** power).toPrecision(3));
    return `${factor === 1 ? '' : `${factor}×`}10${superscript(power)}`;
  }

  // uPlot's own logarithmic ticks begin at the axis' end, which here is no round number.
  function logTicks(min, max) {
    const ticks = [];
    if (max / min < 5) {
      const rough = (max - min) / 5;
      const power = 10 ** Math.floor(Math.log10(rough));
      const step = power * [1, 2, 5, 10].find(factor => factor * power >= rough);
      const first = Math.ceil(min / step);
      for (let n = 0; n < 10; ++n) ticks.push(Number(((first + n) * step).toPrecision(12)));
      return ticks.filter(tick => tick <= max);
    }
    const digits = max / min > 1e6 ? 1 : 9;
    for (let power = Math.floor(Math.log10(min)); power <= Math.log10(max); ++power) {
      for (let digit = 1; digit <= digits; ++digit) {
        const tick = Number(`${digit}e${power}`);
        if (tick >= min && tick <= max) ticks.push(tick);
      }
    }
    return ticks;
  }

  // Those of them that have room for their text.
  function labelledLogTicks(ticks, min, max, pixels, textPixels) {
    if (max / min < 5) return ticks;
    const decade = pixels / Math.log10(max / min);
    const every = Math.ceil(textPixels / decade);
    return ticks.map(tick => {
      const power = Math.floor(Math.log10(tick) + 1e-9);
      const digit = Math.round(tick / 10 ** power);
      const shown = digit === 1 ? power % every === 0 : (digit === 2 || digit === 5) && decade > 4 * textPixels;
      return shown ? tick : null;
    });
  }

  const readable = value => {
    const [factor, power] = Number(value).toPrecision(4).split('e');
    return power === undefined ? factor : `${factor}×10${superscript(Number(power))}`;
  };

  // --- what is drawn ---

  const isShown = (value, axis) => value !== null && (!axis.log || value > 0);

  // Ends of an axis that show everything, with a margin; where given, those of the page's author.
  function homeRange(axis, arrays) {
    const forth = axis.log ? Math.log10 : value => value;
    const back = axis.log ? value => 10 ** value : value => value;
    let from = Infinity;
    let to = -Infinity;
    for (const array of arrays) {
      for (const value of array ?? []) {
        if (!isShown(value, axis)) continue;
        from = Math.min(from, forth(value));
        to = Math.max(to, forth(value));
      }
    }
    if (from > to) [from, to] = axis.log ? [0, 1] : [-1, 1];
    const margin = to > from ? (to - from) * 0.04 : axis.log ? 0.5 : Math.abs(from) * 0.1 || 1;
    const range = [axis.from ?? back(from - margin), axis.to ?? back(to + margin)];
    if (range[0] < range[1]) return range;
    // Only one end is given, and all data lie beyond it.
    const other = axis.log ? 10 : Math.abs(range[0]) || 1;
    if (axis.from !== null) return [axis.from, axis.log ? axis.from * other : axis.from + other];
    return [axis.log ? axis.to / other : axis.to - other, axis.to];
  }

  function addMarker(path, shape, x, y, r) {
    if (shape === 'circle') {
      path.moveTo(x + r, y);
      path.arc(x, y, r, 0, 2 * Math.PI);
      return;
    }
    const corners = {
      square: [[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]],
      triangle: [[0, -1.2], [1.1, 0.8], [-1.1, 0.8]],
      diamond: [[0, -1.25], [1.25, 0], [0, 1.25], [-1.25, 0]],
    }[shape];
    corners.forEach(([dx, dy], i) => path[i ? 'lineTo' : 'moveTo'](x + r * dx, y + r * dy));
    path.closePath();
  }

  // Pixels of the canvas, and which points have any.
  function placesOf(u, plot, series) {
    const y = value => u.valToPos(value, 'y', true);
    const hasX = k => k < series.x.length && isShown(series.x[k], plot.x);
    return {
      x: k => u.valToPos(series.x[k], 'x', true),
      y,
      // What a logarithmic axis cannot show reaches down to its end.
      limit: value => y(isShown(value, plot.y) ? value : u.scales.y.min),
      hasPoint: k => hasX(k) && series.y !== null && isShown(series.y[k], plot.y),
      hasLimits: k => hasX(k) && series.lower[k] !== null && isShown(series.upper[k], plot.y),
    };
  }

  // What uPlot strokes and fills for one series: line, error bars and markers.
  function pathsOf(u, plot, series) {
    const {x, y, limit, hasPoint, hasLimits} = placesOf(u, plot, series);
    const px = uPlot.pxRatio;
    const count = series.x.length;
    const stroke = new Path2D();
    const fill = new Path2D();
    if (hasLine(series)) {
      for (let k = 0, down = false; k < count; ++k) {
        const shown = hasPoint(k);
        if (shown) stroke[down ? 'lineTo' : 'moveTo'](x(k), y(series.y[k]));
        // Between two gaps there is no line to draw.
        if (shown && !down && !hasPoint(k + 1)) addMarker(fill, 'circle', x(k), y(series.y[k]), 2 * px);
        down = shown;
      }
    }
    if (hasMarkers(series)) {
      const radius = (count > 500 ? 1.7 : 3) * px;
      for (let k = 0; k < count; ++k)
        if (hasPoint(k)) addMarker(fill, kShapes[series.look % kShapes.length], x(k), y(series.y[k]), radius);
    }
    if (hasMarkers(series) && series.lower) {
      for (let k = 0; k < count; ++k) {
        if (!hasLimits(k)) continue;
        const ends = [limit(series.lower[k]), limit(series.upper[k])];
        stroke.moveTo(x(k), ends[0]);
        stroke.lineTo(x(k), ends[1]);
        for (const end of ends) {
          stroke.moveTo(x(k) - 3 * px, end);
          stroke.lineTo(x(k) + 3 * px, end);
        }
      }
    }
    return {stroke, fill, flags: 0};
  }

  // Fills the area between lower and upper. Before all series, so that it covers no point.
  function drawBand(u, plot, series) {
    const {x, limit, hasLimits} = placesOf(u, plot, series);
    const path = new Path2D();
    for (let first = 0; first < series.x.length; ++first) {
      let end = first;
      for (; end < series.x.length && hasLimits(end); ++end)
        path[end === first ? 'moveTo' : 'lineTo'](x(end), limit(series.upper[end]));
      for (let k = end - 1; k >= first; --k) path.lineTo(x(k), limit(series.lower[k]));
      first = end;
    }
    const inside = new Path2D();
    inside.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    u.ctx.save();
    u.ctx.clip(inside);
    u.ctx.fillStyle = css(colourName(series.look)) + '40';
    u.ctx.fill(path);
    u.ctx.restore();
  }

  // --- text alternatives ---

  function summaryOf(plot) {
    const extent = (array, axis) => {
      const shown = (array ?? []).filter(value => isShown(value, axis));
      if (!shown.length) return 'no values';
      const [from, to] = shown.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
      return `${readable(from)} to ${readable(to)}`;
    };
    const series = plot.series.map(one =>
      `${one.name || plot.y.label}: ${one.x.length} points, x ${extent(one.x, plot.x)}, ` +
      `y ${extent(one.y ?? [...one.lower, ...one.upper], plot.y)}`);
    return `${plot.title}. Plot of ${titled(plot.y)} over ${titled(plot.x)}. ${series.join('; ')}. ` +
      'Left and right arrow: next point. Up and down: next series. Plus and minus: zoom. Escape: whole plot.';
  }

  const headerOf = plot => [titled(plot.x), titled(plot.y)];
  const limitsHeader = plot => ['lower', 'upper'].map(end => titled({label: end, unit: plot.y.unit}));
  const rowOf = (series, k) => [series.x, series.y, series.lower, series.upper].map(array => array?.[k] ?? '');

  function csvOf(plot) {
    const quoted = text => `"${String(text).replaceAll('"', '""')}"`;
    const lines = [['series', ...headerOf(plot), ...limitsHeader(plot)].map(quoted)];
    for (const series of plot.series) {
      for (let k = 0; k < series.x.length; ++k) lines.push([quoted(series.name), ...rowOf(series, k)]);
    }
    return lines.map(line => line.join(',')).join('\r\n') + '\r\n';
  }

  function fillDetails(details, plot) {
    const name = plot.title.replace(/[^\p{L}\p{N}]+/gu, '-').replace(/^-|-$/g, '') || 'plot';
    const link = element('a', {
      download: `${name}.csv`,
      href: `data:text/csv;charset=utf-8,${encodeURIComponent(csvOf(plot))}`,
    }, 'Download as CSV');
    details.append(element('p', {}, link));
    for (const series of plot.series) {
      const width = series.lower ? 4 : 2;
      const header = [...headerOf(plot), ...limitsHeader(plot)].slice(0, width);
      const row = (tag, cells) => element('tr', {}, ...cells.map(cell =>
        element(tag, tag === 'th' ? {class: 'number', scope: 'col'} : {class: 'number'}, String(cell))));
      const body = element('tbody');
      for (let k = 0; k < Math.min(series.x.length, kTableRows); ++k)
        body.append(row('td', rowOf(series, k).slice(0, width).map(cell => (cell === '' ? '–' : cell))));
      const more = series.x.length - kTableRows;
      const caption = [series.name, more > 0 ? `the first ${kTableRows} points, ${more} more in the CSV` : '']
        .filter(Boolean).join(': ') || plot.y.label;
      details.append(element('div', {class: 'table rows', tabindex: 0, role: 'region', 'aria-label': caption},
        element('table', {}, element('caption', {}, caption), element('thead', {}, row('th', header)), body)));
    }
  }

  // --- one plot ---

  function swatch(series) {
    const parts = [];
    const colour = `var(${colourName(series.look)})`;
    if (series.lower && !hasMarkers(series))
      parts.push(`<rect width="26" height="12" fill="${colour}" fill-opacity="0.25"/>`);
    if (hasLine(series)) {
      const dash = series.style === 'dashed' ? ' stroke-dasharray="6 4"' : '';
      parts.push(`<path d="M0 6H26" stroke="${colour}" stroke-width="2"${dash}/>`);
    }
    if (hasMarkers(series)) {
      const shapes = {
        circle: '<circle cx="13" cy="6" r="4"', square: '<rect x="9.5" y="2.5" width="7" height="7"',
        triangle: '<path d="M13 1l4.5 8.5h-9z"', diamond: '<path d="M13 1l5 5-5 5-5-5z"',
      };
      parts.push(`${shapes[kShapes[series.look % kShapes.length]]} fill="${colour}"/>`);
    }
    const holder = element('span', {'aria-hidden': 'true', style: 'display:inline-flex'});
    holder.innerHTML = `<svg width="26" height="12">${parts.join('')}</svg>`;
    return holder;
  }

  function draw(figure) {
    const plot = JSON.parse(figure.querySelector('script').textContent);
    plot.series.forEach((series, index) => { series.look ??= index; });
    const all = key => plot.series.map(series => series[key]);
    const home = {
      x: homeRange(plot.x, all('x')),
      y: homeRange(plot.y, [...all('y'), ...all('lower'), ...all('upper')]),
    };
    const view = {x: home.x, y: home.y};
    let chosen = null;  // {series, k}: the point read out

    const chart = element('div', {
      class: 'chart', tabindex: 0, role: 'application', 'aria-roledescription': 'plot',
      'aria-label': summaryOf(plot),
    });
    const readout = element('p', {'aria-live': 'polite'});
    const reset = element('button', {type: 'button', hidden: ''}, 'Whole plot');
    const below = element('div', {class: 'below'}, readout, reset);
    const mark = element('div', {class: 'mark', hidden: ''});
    const isEmpty = plot.series.every(({x, y, upper}) =>
      x.every((value, k) => !isShown(value, plot.x) || !isShown((y ?? upper)[k], plot.y)));
    const hint = isEmpty ? 'No values to show.' : 'Drag to zoom in, point to read values.';
    readout.textContent = hint;

    const scale = key => ({
      time: false,
      auto: false,
      distr: plot[key].log ? 3 : 1,
      range: () => view[key],  // asked when no zoom is being set, such as after a series was hidden
    });
    const axis = key => ({
      scale: key,
      side: key === 'x' ? 2 : 3,
      label: titled(plot[key]),
      labelFont: `600 ${kFont}`,
      labelSize: 22,
      font: kFont,
      stroke: () => css('--ink'),
      grid: {stroke: () => css('--grid'), width: 1},
      ticks: {stroke: () => css('--line'), width: 1, size: 5},
      border: {show: true, stroke: () => css('--line'), width: 1},
      gap: 4,
      space: key === 'x' ? 70 : 34,
      ...(plot[key].log && {
        splits: (u, index, min, max) => logTicks(min, max),
        filter: (u, splits) => {
          const {min, max} = u.scales[key];
          return key === 'x' ? labelledLogTicks(splits, min, max, u.over.clientWidth, 40) :
            labelledLogTicks(splits, min, max, u.over.clientHeight, 18);
        },
      }),
      values: (u, splits, index, space, step) =>
        plot[key].log ? splits.map(value => (value === null ? '' : logTickText(value))) : tickTexts(splits, step),
      size: (u, texts, index, cycle) => {
        const own = u.axes[index];
        if (key === 'x' || cycle > 1) return key === 'x' ? 28 : own._size;  // settles at the second try
        u.ctx.font = own.font[0];
        const widths = (texts ?? []).map(text => u.ctx.measureText(text).width / uPlot.pxRatio);
        return Math.max(30, own.ticks.size + own.gap + 4 + Math.max(0, ...widths));
      },
    });

    const u = new uPlot({
      mode: 2,
      width: 300,
      height: 240,
      padding: [10, 14, 0, 0],
      legend: {show: false},
      scales: {x: scale('x'), y: scale('y')},
      axes: [axis('x'), axis('y')],
      series: [{}, ...plot.series.map(series => ({
        auto: false,
        facets: [{scale: 'x', auto: false}, {scale: 'y', auto: false}],
        stroke: () => css(colourName(series.look)),
        fill: () => css(colourName(series.look)),
        width: hasLine(series) ? 1.75 : 1.25,
        dash: series.style === 'dashed' ? [7, 5] : undefined,
        cap: series.style === 'dashed' ? 'butt' : 'round',
        points: {show: false},
        paths: self => pathsOf(self, plot, series),
      }))],
      cursor: {
        points: {show: false},
        drag: {x: true, y: true, uni: 24, dist: 4, setScale: true},  // a flat drag zooms one axis only
        bind: {dblclick: () => () => zoomTo(home.x, home.y)},
      },
      hooks: {
        setScale: [(self, key) => {
          view[key] = [self.scales[key].min, self.scales[key].max];
          reset.hidden = view.x.join() === home.x.join() && view.y.join() === home.y.join();
        }],
        setCursor: [self => {
          // Moves that we did not make ourselves; a pointer that left keeps what keys have chosen.
          if (self.cursor.left >= 0) choose(nearest(self.cursor.left, self.cursor.top));
          else if (document.activeElement !== chart) choose(null);
        }],
        drawAxes: [self => plot.series.forEach((series, index) => {
          const isBand = series.lower && !hasMarkers(series);
          if (isBand && self.series[index + 1].show) drawBand(self, plot, series);
        })],
        draw: [() => placeMark()],
      },
    }, [null, ...plot.series.map(series => [series.x, series.y ?? series.upper])], chart);
    u.over.append(mark);
    figure.uplot = u;  // for tests and the console

    const heightAt = (k, series) => (series.y ? series.y[k] : series.upper[k]);
    const canChoose = (k, series) => isShown(series.x[k], plot.x) && isShown(heightAt(k, series), plot.y);
    const isOn = index => u.series[index + 1].show;

    function nearest(left, top) {
      let best = null;
      let distance = kReach ** 2;
      plot.series.forEach((series, index) => {
        if (!isOn(index)) return;
        for (let k = 0; k < series.x.length; ++k) {
          if (!canChoose(k, series)) continue;
          const square = (u.valToPos(series.x[k], 'x') - left) ** 2 +
            (u.valToPos(heightAt(k, series), 'y') - top) ** 2;
          if (square >= distance) continue;
          distance = square;
          best = {index, k};
        }
      });
      return best;
    }

    function placeMark() {
      const place = chosen && {
        x: u.valToPos(plot.series[chosen.index].x[chosen.k], 'x'),
        y: u.valToPos(heightAt(chosen.k, plot.series[chosen.index]), 'y'),
      };
      mark.hidden = !place || place.x < 0 || place.y < 0 || place.x > u.over.clientWidth ||
        place.y > u.over.clientHeight;
      if (!mark.hidden) mark.style.translate = `${place.x}px ${place.y}px`;
    }

    function choose(point) {
      chosen = point;
      placeMark();
      if (!point) {
        readout.textContent = hint;
        return;
      }
      const series = plot.series[point.index];
      const value = (key, number) => `${readable(number)}${plot[key].unit ? ` ${plot[key].unit}` : ''}`;
      const parts = [`${plot.x.label} ${value('x', series.x[point.k])}`];
      if (series.y) parts.push(`${plot.y.label} ${value('y', series.y[point.k])}`);
      const ends = [series.lower?.[point.k] ?? null, series.upper?.[point.k] ?? null];
      if (!ends.includes(null)) parts.push(`${readable(ends[0])} to ${value('y', ends[1])}`);
      readout.textContent = (series.name ? `${series.name}: ` : '') + parts.join(', ');
    }

    function zoomTo(x, y) {
      u.batch(() => {
        u.setScale('x', {min: x[0], max: x[1]});
        u.setScale('y', {min: y[0], max: y[1]});
      });
    }

    // About the point read out, or the middle; out to the whole plot and no further.
    function zoomBy(factor) {
      const zoomed = key => {
        const forth = plot[key].log ? Math.log10 : value => value;
        const back = plot[key].log ? value => 10 ** value : value => value;
        const [from, to] = view[key].map(forth);
        const value = chosen && plot.series[chosen.index];
        const at = value ? forth(key === 'x' ? value.x[chosen.k] : heightAt(chosen.k, value)) : (from + to) / 2;
        const middle = at >= from && at <= to ? at : (from + to) / 2;
        const ends = [back(middle + (from - middle) * factor), back(middle + (to - middle) * factor)];
        return [Math.max(ends[0], home[key][0]), Math.min(ends[1], home[key][1])];
      };
      zoomTo(zoomed('x'), zoomed('y'));
    }

    function step(by, from = chosen?.k) {
      const index = chosen && isOn(chosen.index) ? chosen.index : plot.series.findIndex((_, i) => isOn(i));
      if (index < 0) return;
      const series = plot.series[index];
      let k = from ?? (by > 0 ? -1 : series.x.length);
      do k += by; while (k >= 0 && k < series.x.length && !canChoose(k, series));
      if (k >= 0 && k < series.x.length) choose({index, k});
    }

    function stepSeries(by) {
      const count = plot.series.length;
      for (let i = 1; i <= count; ++i) {
        const index = ((chosen?.index ?? -by) + by * i + count * i) % count;
        if (!isOn(index)) continue;
        chosen = {index, k: -1};
        const same = plot.series[index].x.findIndex((_, k) => canChoose(k, plot.series[index]));
        choose(same < 0 ? null : {index, k: same});
        return;
      }
    }

    const keys = {
      ArrowRight: () => step(1), ArrowLeft: () => step(-1),
      ArrowUp: () => stepSeries(-1), ArrowDown: () => stepSeries(1),
      Home: () => step(1, -1), End: () => step(-1, plot.series[chosen?.index ?? 0].x.length),
      '+': () => zoomBy(0.7), '=': () => zoomBy(0.7), '-': () => zoomBy(1 / 0.7),
      Escape: () => zoomTo(home.x, home.y), 0: () => zoomTo(home.x, home.y),
    };
    chart.addEventListener('keydown', event => {
      if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    });
    chart.addEventListener('blur', () => choose(null));
    reset.addEventListener('click', () => {
      zoomTo(home.x, home.y);
      chart.focus();
    });

    const legend = element('ul', {class: 'legend'});
    plot.series.forEach((series, index) => {
      if (!series.name) return;
      const button = element('button', {type: 'button', 'aria-pressed': 'true', title: 'Show or hide'},
        swatch(series), series.name);
      button.addEventListener('click', () => {
        const show = !isOn(index);
        if (!show && chosen?.index === index) choose(null);
        u.setSeries(index + 1, {show});
        button.setAttribute('aria-pressed', String(show));
      });
      legend.append(element('li', {}, button));
    });

    const details = element('details', {}, element('summary', {}, 'Data of this plot'));
    details.addEventListener('toggle', () => fillDetails(details, plot), {once: true});

    if (legend.childElementCount) figure.append(legend);
    figure.append(chart, below, details);
    const thinned = figure.querySelector('.thinned');
    if (thinned) details.before(thinned);

    const fit = () => {
      const width = isPrinting ? kPaperWidth : chart.clientWidth;
      if (width > 0) u.setSize({width, height: Math.round(Math.min(420, Math.max(250, width * 0.6)))});
    };
    new ResizeObserver(() => fit()).observe(chart);
    fit();
    return {u, fit};
  }

  const plots = [...document.querySelectorAll('figure.plot')].map(draw);

  const recolour = () => {
    colours = {};
    for (const {u} of plots) u.redraw();
  };
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', recolour);
  // Paper is white, and narrower than most windows.
  const print = on => {
    isPrinting = on;
    document.documentElement.classList.toggle('print', on);
    for (const {fit} of plots) fit();
    recolour();
  };
  addEventListener('beforeprint', () => print(true));
  addEventListener('afterprint', () => print(false));
})();
