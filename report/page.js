// Draws each <figure class="plot"> from its JSON. dygraphs does scales, axes and canvas. It has one x for all
// series, but each of our series has its own x; therefore series, zoom, legend, read-out, keys and table are here.
'use strict';
(() => {
  const kColours = 7;
  const kShapes = ['circle', 'square', 'triangle', 'diamond'];  // colour is never the only difference
  const kTableRows = 200;
  const kReach = 30;  // pixels from the pointer within which a point is read out
  const kDrag = 4;  // pixels: a longer drag zooms
  const kFlat = 24;  // pixels: a drag that is longer along an axis zooms this axis, too
  const kTickSpace = {x: 70, y: 34};  // pixels
  const kPaperWidth = 640;
  const kInterleave = 9;  // pixels: of each of two equal lines, in turn

  let isPrinting = false;

  // Colours come from the style sheet, which supports light and dark mode; discarded when the mode changes.
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
  const escaped = text => element('p', {}, text).innerHTML;
  const titled = axis => (axis.unit ? `${axis.label} (${axis.unit})` : axis.label);
  const hasMarkers = series => series.style.endsWith('points');
  const hasLine = series => series.style !== 'points' && series.y !== null;

  // --- numbers ---

  const pen = document.createElement('canvas').getContext('2d');
  pen.font = '12px system-ui, sans-serif';  // as the style sheet has it
  const textWidth = text => pen.measureText(text).width;

  const superscript = number =>
    String(number).replace(/[-\d]/g, c => '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'['-0123456789'.indexOf(c)]);

  function decimalsOf(step) {
    let decimals = 0;
    while (decimals < 12 && Math.abs(step - Number(step.toFixed(decimals))) > step * 1e-6) ++decimals;
    return decimals;
  }

  // What an axis is linear in.
  const scaleOf = ({log}) => (log ? {forth: Math.log10, back: value => 10 ** value} :
    {forth: value => value, back: value => value});

  // Factors out a power of ten where plain numbers would be long.
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

  function logTicks(min, max, pixels, space) {
    const ticks = [];
    const decade = pixels / Math.log10(max / min);
    const room = 0.55 * space;  // these numbers are short
    const every = Math.ceil(room / decade);
    const digits = max / min > 1e6 ? 1 : 9;
    for (let power = Math.floor(Math.log10(min)); power <= Math.log10(max); ++power) {
      for (let digit = 1; digit <= digits; ++digit) {
        const v = Number(`${digit}e${power}`);
        if (v < min || v > max) continue;
        const hasText = digit === 1 ? power % every === 0 : (digit === 2 || digit === 5) && decade > 4 * room;
        ticks.push(hasText ? {v, label: logTickText(v)} : {v});
      }
    }
    return ticks;
  }

  function roundTicks(min, max, pixels, space) {
    const rough = (max - min) * space / pixels;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find(factor => factor * power >= rough);
    const first = Math.ceil(min / step - 1e-9);
    const count = Math.floor(max / step + 1e-9) - first + 1;
    const values = Array.from({length: count}, (_, n) => Number(((first + n) * step).toPrecision(12)));
    const texts = tickTexts(values, step);
    return values.map((v, n) => ({v, label: texts[n]}));
  }

  // For dygraphs: values with a grid line, and their text where there is room.
  function ticksOf(axis, space, min, max, pixels) {
    const ticks = (axis.log && max / min >= 5 ? logTicks : roundTicks)(min, max, pixels, space);
    // dygraphs leaves out a tick exactly at the upper end.
    const end = max - (max - min) * 1e-9;
    return ticks.map(({v, label}) => ({v: Math.min(v, end), label}));
  }

  const readable = value => {
    const [factor, power] = Number(value).toPrecision(4).split('e');
    return power === undefined ? factor : `${factor}×10${superscript(Number(power))}`;
  };

  // --- drawing ---

  const isShown = (value, axis) => value !== null && (!axis.log || value > 0);

  // Axis limits that show all data with a margin; limits given by the page's author take precedence.
  function homeRange(axis, arrays) {
    const {forth, back} = scaleOf(axis);
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

  // Pixels of the plot. dygraphs' toDomXCoord() knows no logarithmic axis.
  function pixelsOf(g) {
    const {x: left, y: top, w: width, h: height} = g.getArea();
    return {
      x: value => left + width * g.toPercentXCoord(value),
      y: value => g.toDomYCoord(value),
      bottom: top + height,
    };
  }

  // Pixel positions of a series' points, and which of them are finite.
  function placesOf(pixels, plot, series) {
    const hasX = k => k < series.x.length && isShown(series.x[k], plot.x);
    return {
      x: k => pixels.x(series.x[k]),
      y: pixels.y,
      // A value that a logarithmic axis cannot show extends to its lower end.
      limit: value => (isShown(value, plot.y) ? pixels.y(value) : pixels.bottom),
      hasPoint: k => hasX(k) && series.y !== null && isShown(series.y[k], plot.y),
      hasLimits: k => hasX(k) && series.lower[k] !== null && isShown(series.upper[k], plot.y),
    };
  }

  function lineOf({x, y, hasPoint}, series, fill) {
    const stroke = new Path2D();
    for (let k = 0, down = false; k < series.x.length; ++k) {
      const shown = hasPoint(k);
      if (shown) stroke[down ? 'lineTo' : 'moveTo'](x(k), y(series.y[k]));
      // A point between two gaps has no line.
      if (shown && !down && !hasPoint(k + 1)) addMarker(fill, 'circle', x(k), y(series.y[k]), 2);
      down = shown;
    }
    return stroke;
  }

  // Lines that are equal show their colours in turn: over all of them, each is drawn once more with gaps.
  function interleave(context, pixels, plot, lines) {
    lines.forEach((series, index) => {
      const stroke = lineOf(placesOf(pixels, plot, series), series, new Path2D());
      context.strokeStyle = css(colourName(series.look));
      context.lineWidth = 1.75;
      context.lineCap = 'butt';
      context.setLineDash([kInterleave, kInterleave * (lines.length - 1)]);
      context.lineDashOffset = -kInterleave * index;
      context.stroke(stroke);
    });
    context.lineDashOffset = 0;
    context.setLineDash([]);
  }

  // Line, error bars and markers.
  function drawSeries(context, pixels, plot, series) {
    const {x, y, limit, hasPoint, hasLimits} = placesOf(pixels, plot, series);
    const count = series.x.length;
    const fill = new Path2D();
    const stroke = hasLine(series) ? lineOf({x, y, hasPoint}, series, fill) : new Path2D();
    if (hasMarkers(series)) {
      const radius = count > 500 ? 1.7 : 3;
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
          stroke.moveTo(x(k) - 3, end);
          stroke.lineTo(x(k) + 3, end);
        }
      }
    }
    const isDashed = series.style === 'dashed';
    context.strokeStyle = context.fillStyle = css(colourName(series.look));
    context.lineWidth = hasLine(series) ? 1.75 : 1.25;
    context.lineJoin = 'round';
    context.lineCap = isDashed ? 'butt' : 'round';
    context.setLineDash(isDashed ? [7, 5] : []);
    context.stroke(stroke);
    context.fill(fill);
  }

  // Fills the area between lower and upper.
  function drawBand(context, pixels, plot, series) {
    const {x, limit, hasLimits} = placesOf(pixels, plot, series);
    const path = new Path2D();
    for (let first = 0; first < series.x.length; ++first) {
      let end = first;
      for (; end < series.x.length && hasLimits(end); ++end)
        path[end === first ? 'moveTo' : 'lineTo'](x(end), limit(series.upper[end]));
      for (let k = end - 1; k >= first; --k) path.lineTo(x(k), limit(series.lower[k]));
      first = end;
    }
    context.fillStyle = css(colourName(series.look)) + '40';
    context.fill(path);
  }

  // Shades every other span; a span of one point is a line.
  function drawSpans(context, area, pixels, spans) {
    spans.forEach(({from, to}, index) => {
      const [left, right] = [from, to].map(x => Math.min(Math.max(pixels.x(x), area.x), area.x + area.w));
      const isLine = from === to;
      context.fillStyle = css(isLine ? '--soft' : '--grid');
      if (isLine ? left === pixels.x(from) : index % 2 === 0)
        context.fillRect(isLine ? left - 0.75 : left, area.y, isLine ? 1.5 : right - left, area.h);
    });
  }

  // The names that have room, over the curves; those of lines below those of stretches.
  function nameSpans(context, area, pixels, spans) {
    context.save();
    context.font = pen.font;
    context.textBaseline = 'top';
    context.lineJoin = 'round';
    context.lineWidth = 3;
    context.strokeStyle = css('--panel');
    context.fillStyle = css('--ink');
    let lastLine = -Infinity;
    for (const {name, from, to} of spans) {
      const isLine = from === to;
      const [left, right] = [from, to].map(x => Math.min(Math.max(pixels.x(x), area.x), area.x + area.w));
      const width = textWidth(name) + 6;
      if (isLine ? left !== pixels.x(from) || left < lastLine : width > right - left) continue;
      const at = isLine && left + width > area.x + area.w ? left - width : left + 4;
      if (isLine) lastLine = at + width;
      const top = area.y + (isLine ? 19 : 3);
      context.strokeText(name, at, top);
      context.fillText(name, at, top);
    }
    context.restore();
  }

  // --- values at an x ---

  // Whether the points go forth only, so that each x has one y.
  function goesForth({x}, axis) {
    let last = -Infinity;
    return x.every(value => {
      if (!isShown(value, axis)) return true;
      const isForth = value >= last;
      last = value;
      return isForth;
    });
  }

  // Per array of a series at x: between two joined points on the straight line; otherwise at the nearest point that
  // is less than `reach` away. Null without one.
  function valuesAt(plot, series, x, reach) {
    const xs = series.x;
    let low = 0;
    let high = xs.length - 1;
    while (low < high) {  // the first point from x on
      const middle = (low + high) >> 1;
      let k = middle;
      while (k < high && xs[k] === null) ++k;
      if (xs[k] !== null && xs[k] < x) low = k + 1;
      else high = middle;
    }
    const hasPoint = k => k >= 0 && k < xs.length && isShown(xs[k], plot.x);
    const isBetween = hasPoint(low - 1) && hasPoint(low) && xs[low - 1] <= x && x <= xs[low] && xs[low - 1] < xs[low];
    const scaleX = scaleOf(plot.x);
    const scaleY = scaleOf(plot.y);
    const nearest = [low - 1, low].filter(hasPoint)
      .sort((a, b) => Math.abs(scaleX.forth(xs[a]) - scaleX.forth(x)) - Math.abs(scaleX.forth(xs[b]) - scaleX.forth(x)))[0];
    const isNear = nearest !== undefined && Math.abs(scaleX.forth(xs[nearest]) - scaleX.forth(x)) <= reach;
    return ['y', 'lower', 'upper'].map(key => {
      const values = series[key];
      if (!values) return null;
      const shown = k => hasPoint(k) && isShown(values[k], plot.y);
      if (series.style !== 'points' && isBetween && shown(low - 1) && shown(low)) {
        const [from, to, at] = [xs[low - 1], xs[low], x].map(scaleX.forth);
        const [first, last] = [values[low - 1], values[low]].map(scaleY.forth);
        return scaleY.back(first + (last - first) * (at - from) / (to - from));
      }
      return isNear && shown(nearest) ? values[nearest] : null;
    });
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
    const spans = plot.spans.map(({name, from, to}) =>
      (from === to ? `${name} at ${readable(from)}` : `${name} ${readable(from)} to ${readable(to)}`));
    return `${plot.title}. Plot of ${titled(plot.y)} over ${titled(plot.x)}. ${series.join('; ')}. ` +
      (spans.length ? `Marked: ${spans.join(', ')}. ` : '') +
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

  // Plots whose x axes are linked: their common range, and what moves together.
  const links = new Map();

  function read(figure) {
    const plot = JSON.parse(figure.querySelector('script').textContent);
    plot.series.forEach((series, index) => { series.look ??= index; });
    plot.isFunction = !plot.equal && plot.series.every(series => goesForth(series, plot.x));
    const all = key => plot.series.map(series => series[key]);
    const home = {
      x: homeRange(plot.x, all('x')),
      y: homeRange(plot.y, [...all('y'), ...all('lower'), ...all('upper')]),
    };
    if (plot.x.link && all('x').some(x => x.some(value => isShown(value, plot.x)))) {
      const link = links.get(plot.x.link) ?? {x: home.x, members: []};
      link.x = [Math.min(link.x[0], home.x[0]), Math.max(link.x[1], home.x[1])];
      links.set(plot.x.link, link);
    }
    return {figure, plot, home};
  }

  function draw({figure, plot, home}) {
    const link = links.get(plot.x.link) ?? {x: home.x, members: []};
    home.x = link.x;
    const view = {...home};
    const isOn = plot.series.map(() => true);
    let chosen = null;  // {index, k}: the point read out
    let dragFrom = null;  // [left, top] in pixels

    const chart = element('div', {
      class: 'chart', tabindex: 0, role: 'application', 'aria-roledescription': 'plot',
      'aria-label': summaryOf(plot),
    });
    const surface = element('div', {class: 'surface'});
    chart.append(surface);
    const readout = element('p', {'aria-live': 'polite'});
    const reset = element('button', {type: 'button', hidden: ''}, 'Whole plot');
    const below = element('div', {class: 'below'}, readout, reset);
    figure.append(chart, below);
    const mark = element('div', {class: 'mark', hidden: ''});
    const cross = element('div', {class: 'cross', hidden: ''});
    const selection = element('div', {class: 'selection', hidden: ''});
    const line = element('div', {class: 'line', hidden: ''});
    const over = element('div', {class: 'over'}, cross, selection, line, mark);
    const tip = element('div', {class: 'tip', hidden: '', 'aria-hidden': 'true'});  // the read-out has the words
    const isEmpty = plot.series.every(({x, y, upper}) =>
      x.every((value, k) => !isShown(value, plot.x) || !isShown((y ?? upper)[k], plot.y)));
    const hint = isEmpty ? 'No values to show.' : 'Drag to zoom in, point to read values.';
    readout.textContent = hint;

    const axis = key => ({
      logscale: plot[key].log,
      axisLabelFontSize: 12,
      axisLineWidth: 1,
      gridLineWidth: 1,
      ticker: (min, max, pixels) => ticksOf(plot[key], kTickSpace[key], min, max, pixels),
    });
    function layout(event) {
      event.reserveSpaceTop(8);  // for half a number
      // dygraphs clears only the new plot area; this clears the current one.
      event.chart_div.querySelector('canvas').getContext('2d').clearRect(0, 0, 1e4, 1e4);
    }
    // Its own data are one point without a value, so that it calls the plotter once per drawing.
    const g = new Dygraph(surface, [[1, null]], {
      labels: ['x', 'y'],
      axes: {x: {...axis('x'), axisLabelWidth: 50}, y: {...axis('y'), valueRange: view.y}},
      dateWindow: view.x,
      xlabel: escaped(titled(plot.x)),
      ylabel: escaped(titled(plot.y)),
      xAxisHeight: 24,
      rightGap: 25,  // the number at the end of the axis reaches beyond it by half its width
      plugins: [{activate: () => ({layout})}],
      legend: 'never',
      plotter({drawingContext, dygraph}) {
        const pixels = pixelsOf(dygraph);
        const shown = plot.series.filter((_, index) => isOn[index]);
        drawSpans(drawingContext, dygraph.getArea(), pixels, plot.spans);
        const bands = shown.filter(series => series.lower && !hasMarkers(series));
        for (const series of bands) drawBand(drawingContext, pixels, plot, series);
        // Dashes last: through their gaps a line below stays visible.
        const lines = shown.filter(series => hasLine(series) && series.style !== 'dashed');
        for (const series of lines) drawSeries(drawingContext, pixels, plot, series);
        if (lines.length > 1) interleave(drawingContext, pixels, plot, lines);
        for (const series of shown.filter(one => !lines.includes(one))) drawSeries(drawingContext, pixels, plot, series);
        nameSpans(drawingContext, dygraph.getArea(), pixels, plot.spans);
      },
      interactionModel: {
        // A drag may leave the plot and come back.
        pointerdown: event => event.target.setPointerCapture(event.pointerId),
        mousedown({button, offsetX, offsetY}) {
          if (button === 0) dragFrom = [offsetX, offsetY];
        },
        mousemove({buttons, offsetX: left, offsetY: top}) {
          if (buttons === 0) endDrag();
          cross.hidden = false;
          cross.style.translate = `${left}px ${top}px`;
          choose(nearest(left, top));
          hover(left, top);
          const box = boxTo(left, top);
          selection.hidden = !box;
          if (!box) return;
          selection.style.translate = `${box.x[0]}px ${box.y[0]}px`;
          selection.style.width = `${box.x[1] - box.x[0]}px`;
          selection.style.height = `${box.y[1] - box.y[0]}px`;
        },
        mouseup({offsetX, offsetY}) {
          const box = boxTo(offsetX, offsetY);
          endDrag();
          if (box) zoomTo(box.x.map(x => g.toDataXCoord(x)), box.y.map(y => g.toDataYCoord(y)).reverse());
        },
        mouseleave() {
          cross.hidden = true;
          for (const member of link.members) member.showAt(null);
          // A pointer that leaves keeps what keys have chosen.
          if (document.activeElement !== chart) choose(null);
        },
        dblclick: () => zoomTo(home.x, home.y),
      },
    });
    surface.append(over, tip);

    // The area of a drag in the plot; a flat drag covers the whole other axis.
    function boxTo(left, top) {
      if (!dragFrom) return null;
      const area = g.getArea();
      const width = Math.abs(left - dragFrom[0]);
      const height = Math.abs(top - dragFrom[1]);
      if (Math.max(width, height) < kDrag) return null;
      const isFlat = (one, other) => one < kFlat && one < other;
      const span = (isWhole, ends, first, last) => (isWhole ? [first, last] :
        ends.map(end => Math.min(Math.max(end, first), last)).sort((a, b) => a - b));
      return {
        x: span(isFlat(width, height), [dragFrom[0], left], area.x, area.x + area.w),
        y: span(isFlat(height, width), [dragFrom[1], top], area.y, area.y + area.h),
      };
    }

    function endDrag() {
      dragFrom = null;
      selection.hidden = true;
    }

    // The range that is drawn: for equal axes, what is missing in the view to the shape of the plot is added.
    function drawn() {
      if (!plot.equal) return view;
      const {w, h} = g.getArea();
      const perPixel = Math.max((view.x[1] - view.x[0]) / w, (view.y[1] - view.y[0]) / h);
      const wide = ([from, to], pixels) => [-0.5, 0.5].map(share => (from + to) / 2 + share * perPixel * pixels);
      return {x: wide(view.x, w), y: wide(view.y, h)};
    }

    // Draws the current view, with room for the numbers of both axes and the title of y.
    function show() {
      const texts = (key, pixels) => ticksOf(plot[key], kTickSpace[key], ...drawn()[key], pixels)
        .map(({label}) => textWidth(label ?? ''));
      const area = g.getArea();
      // An integer: dygraphs clips the plot there, and half a pixel would be drawn but never cleared.
      const axisLabelWidth = Math.ceil(20 + Math.max(10, ...texts('y', area.h)));
      // The number at the end of x reaches beyond it by half its width.
      const rightGap = Math.ceil(Math.max(25, ...texts('x', area.w).map(width => width / 2 + 4)));
      const place = () => g.updateOptions({
        dateWindow: drawn().x, axes: {y: {valueRange: drawn().y, axisLabelWidth}}, rightGap,
        axisLineColor: css('--line'),
        gridLineColor: css('--grid'),
      });
      place();
      if (plot.equal) place();  // in the area that is left beside the numbers
      const {x, y, w, h} = g.getArea();
      // With room for the marker of a point at the end of an axis.
      over.style.clipPath = `rect(${y - 8}px ${x + w + 8}px ${y + h + 8}px ${x - 8}px)`;
      surface.style.setProperty('--left', `${x}px`);
      placeMark();
      showAt(null);
    }

    // For tests and the console.
    figure.plot = {
      view,
      isOn,
      show,
      colourOf: index => css(colourName(plot.series[index].look)),
      toPixels: (x, y) => [pixelsOf(g).x(x), pixelsOf(g).y(y)],
    };

    const heightAt = (k, series) => (series.y ? series.y[k] : series.upper[k]);
    const canChoose = (k, series) => isShown(series.x[k], plot.x) && isShown(heightAt(k, series), plot.y);

    function nearest(left, top, only = null) {
      const pixels = pixelsOf(g);
      let best = null;
      let distance = kReach ** 2;
      plot.series.forEach((series, index) => {
        if (!isOn[index] || (only !== null && only !== index)) return;
        for (let k = 0; k < series.x.length; ++k) {
          if (!canChoose(k, series)) continue;
          const square = (pixels.x(series.x[k]) - left) ** 2 + (pixels.y(heightAt(k, series)) - top) ** 2;
          if (square >= distance) continue;
          distance = square;
          best = {index, k};
        }
      });
      return best;
    }

    const valueText = (key, number) => `${readable(number)}${plot[key].unit ? ` ${plot[key].unit}` : ''}`;

    // What the tip says: a title and, for each series, its values.
    function showTip(title, entries, left, top) {
      tip.replaceChildren(element('p', {}, title), ...entries.map(({series, text}) =>
        element('p', {}, swatch(series), element('span', {}, series.name || plot.y.label), element('b', {}, text))));
      tip.hidden = false;
      const area = g.getArea();
      const side = left + 14 + tip.offsetWidth > surface.clientWidth ? Math.max(0, left - 14 - tip.offsetWidth) : left + 14;
      tip.style.translate = `${side}px ${Math.max(0, Math.min(top, area.y + area.h - tip.offsetHeight))}px`;
    }

    // The values of all series at x, with a line there; null hides both.
    function showAt(x, top = g.getArea().y + 22) {
      line.hidden = tip.hidden = true;
      const range = drawn().x;
      if (!plot.isFunction || x === null || x < range[0] || x > range[1]) return;
      const shown = plot.series.filter((_, index) => isOn[index]);
      const left = pixelsOf(g).x(x);
      const {forth} = scaleOf(plot.x);
      const reach = kReach * (forth(range[1]) - forth(range[0])) / g.getArea().w;
      const entries = shown.flatMap(series => {
        const [y, lower, upper] = valuesAt(plot, series, x, reach);
        if (y === null && upper === null) return [];
        const limits = lower === null || upper === null ? '' : `${readable(lower)} to ${valueText('y', upper)}`;
        return [{series, text: [y === null ? '' : valueText('y', y), limits].filter(Boolean).join(', ')}];
      });
      line.style.translate = `${left}px 0`;
      line.hidden = false;
      const span = plot.spans.find(({from, to}) => from <= x && x < to);
      showTip(`${plot.x.label} ${valueText('x', x)}${span ? `, ${span.name}` : ''}`, entries, left, top);
    }

    // Where an x has several y: of each series, the point nearest the pointer.
    function showNear(left, top) {
      const entries = plot.series.flatMap((series, index) => {
        const point = isOn[index] && nearest(left, top, index);
        if (!point) return [];
        return [{series, text: `${valueText('x', series.x[point.k])}, ${valueText('y', heightAt(point.k, series))}`}];
      });
      tip.hidden = true;
      if (entries.length) showTip(`${titled(plot.x)}, ${titled(plot.y)}`, entries, left, top);
    }

    function hover(left, top) {
      const x = g.toDataXCoord(left);
      if (!plot.isFunction) showNear(left, top);
      else for (const member of link.members) member.showAt(x, member.show === show ? top : undefined);
    }

    function placeMark() {
      mark.hidden = !chosen;
      if (!chosen) return;
      const series = plot.series[chosen.index];
      const pixels = pixelsOf(g);
      mark.style.translate = `${pixels.x(series.x[chosen.k])}px ${pixels.y(heightAt(chosen.k, series))}px`;
    }

    function choose(point) {
      chosen = point;
      placeMark();
      if (!point) {
        readout.textContent = hint;
        return;
      }
      const series = plot.series[point.index];
      const parts = [`${plot.x.label} ${valueText('x', series.x[point.k])}`];
      if (series.y) parts.push(`${plot.y.label} ${valueText('y', series.y[point.k])}`);
      const ends = [series.lower?.[point.k] ?? null, series.upper?.[point.k] ?? null];
      if (!ends.includes(null)) parts.push(`${readable(ends[0])} to ${valueText('y', ends[1])}`);
      readout.textContent = (series.name ? `${series.name}: ` : '') + parts.join(', ');
    }

    function setView(x, y) {
      Object.assign(view, {x, y});
      reset.hidden = x.join() === home.x.join() && y.join() === home.y.join();
      show();
    }

    function zoomTo(x, y) {
      if (!(x[0] < x[1] && y[0] < y[1])) return;  // nothing to see
      for (const member of link.members) if (member.show !== show) member.zoomX(x);
      setView(x, y);
    }

    // Zooms about the point that is read out, or the centre; at most out to the whole plot.
    function zoomBy(factor) {
      const zoomed = key => {
        const {forth, back} = scaleOf(plot[key]);
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
      const index = chosen && isOn[chosen.index] ? chosen.index : isOn.indexOf(true);
      if (index < 0) return;
      const series = plot.series[index];
      let k = from ?? (by > 0 ? -1 : series.x.length);
      do k += by; while (k >= 0 && k < series.x.length && !canChoose(k, series));
      if (k >= 0 && k < series.x.length) chooseByKey({index, k});
    }

    function chooseByKey(point) {
      choose(point);
      if (!point) return;
      const series = plot.series[point.index];
      const pixels = pixelsOf(g);
      hover(pixels.x(series.x[point.k]), pixels.y(heightAt(point.k, series)));
    }

    function stepSeries(by) {
      const count = plot.series.length;
      for (let i = 1; i <= count; ++i) {
        const index = ((chosen?.index ?? -by) + by * i + count * i) % count;
        if (!isOn[index]) continue;
        chosen = {index, k: -1};
        const same = plot.series[index].x.findIndex((_, k) => canChoose(k, plot.series[index]));
        chooseByKey(same < 0 ? null : {index, k: same});
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
    chart.addEventListener('blur', () => {
      choose(null);
      for (const member of link.members) member.showAt(null);
    });
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
        isOn[index] = !isOn[index];
        if (!isOn[index] && chosen?.index === index) choose(null);
        button.setAttribute('aria-pressed', String(isOn[index]));
        show();
      });
      legend.append(element('li', {}, button));
    });

    const details = element('details', {}, element('summary', {}, 'Data of this plot'));
    details.addEventListener('toggle', () => fillDetails(details, plot), {once: true});

    if (legend.childElementCount) chart.before(legend);
    figure.append(details);
    const thinned = figure.querySelector('.thinned');
    if (thinned) details.before(thinned);

    let ratio = devicePixelRatio;
    const fit = () => {
      const width = isPrinting ? kPaperWidth : chart.clientWidth;
      if (width <= 0) return;
      // A plot with equal axes is as high as its contents.
      const shape = plot.equal ? Math.min(1, (home.y[1] - home.y[0]) / (home.x[1] - home.x[0])) : 0.6;
      const height = Math.round(Math.min(plot.equal ? 560 : 420, Math.max(250, width * shape)));
      // dygraphs follows the pixel ratio only when the size changes.
      if (ratio !== devicePixelRatio) g.resize(width, height + 1);
      ratio = devicePixelRatio;
      g.resize(width, height);
      show();
    };
    new ResizeObserver(() => fit()).observe(chart);
    fit();
    const api = {fit, show, showAt, zoomX: x => setView(x, view.y)};
    link.members.push(api);
    return api;
  }

  const plots = [...document.querySelectorAll('figure.plot')].map(read).map(draw);

  // A table that is wider than the window says that there is more.
  const boxes = [...document.querySelectorAll('main > .table')];
  const hintAtWidth = () => {
    for (const box of boxes) box.classList.toggle('wide', box.scrollWidth > box.clientWidth + 1);
  };
  new ResizeObserver(hintAtWidth).observe(document.documentElement);
  hintAtWidth();

  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
    colours = {};
    for (const {show} of plots) show();
  });
  // Zooming the browser, or moving the window to another screen, keeps the size.
  const followRatio = () =>
    matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener('change', () => {
      for (const {fit} of plots) fit();
      followRatio();
    }, {once: true});
  followRatio();
  // Paper is white, and narrower than most windows.
  const print = on => {
    isPrinting = on;
    document.documentElement.classList.toggle('print', on);
    colours = {};
    for (const {fit} of plots) fit();
  };
  addEventListener('beforeprint', () => print(true));
  addEventListener('afterprint', () => print(false));
})();
