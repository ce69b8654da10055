// Plots of the last 30 s of any signals. The script of dygraphs is loaded before.
const kSpan_s = 30;
const kColours = ['#1f5fbf', '#d9480f', '#1f9d55', '#7048e8', '#c2255c', '#0b7285', '#946200', '#495057'];

// Values of all signals over the last 30 s, in memory of fixed size.
export class History {
  constructor(names, rate_Hz) {
    this.names = names;
    this.capacity = Math.ceil(kSpan_s * rate_Hz * 1.2);
    this.times = new Float64Array(this.capacity);
    this.values = new Float32Array(this.capacity * names.length);
    this.size = 0;
    this.next = 0;
  }

  add(time_s, values) {
    this.times[this.next] = time_s;
    this.values.set(values, this.next * this.names.length);
    this.next = (this.next + 1) % this.capacity;
    this.size = Math.min(this.size + 1, this.capacity);
  }

  // Rows [seconds before now, value...] of these signals, oldest first.
  rows(signals) {
    const columns = signals.map(name => this.names.indexOf(name));
    const newest = this.times[(this.next + this.capacity - 1) % this.capacity];
    const rows = [];
    for (let i = this.size; i > 0; --i) {
      const at = (this.next + this.capacity - i) % this.capacity;
      const age = this.times[at] - newest;
      if (age >= -kSpan_s) rows.push([age, ...columns.map(column => this.values[at * this.names.length + column])]);
    }
    return rows;
  }
}

class Plot {
  constructor(parent, history, signals, removed) {
    this.history = history;
    this.signals = signals;
    this.root = document.createElement('div');
    this.root.className = 'plot';
    this.root.innerHTML = '<div class="signals"></div><div class="canvas"></div>';
    parent.append(this.root);
    this.canvas = this.root.querySelector('.canvas');
    this.removed = removed;
    this.list();
  }

  list() {
    const row = this.root.querySelector('.signals');
    row.replaceChildren(...this.signals.map((name, i) => {
      const chip = document.createElement('button');
      chip.className = 'chip';
      chip.style.borderColor = kColours[i % kColours.length];
      chip.textContent = name;
      chip.title = `remove ${name} from this plot`;
      chip.onclick = () => this.choose(this.signals.filter(other => other !== name));
      return chip;
    }));
    const input = document.createElement('input');
    input.setAttribute('list', 'signals');
    input.placeholder = 'add a signal';
    input.setAttribute('aria-label', 'add a signal to this plot');
    input.onchange = () => {
      if (this.history.names.includes(input.value) && !this.signals.includes(input.value))
        this.choose([...this.signals, input.value]);
      input.value = '';
    };
    row.append(input);
  }

  choose(signals) {
    this.signals = signals;
    this.graph?.destroy();
    this.graph = null;
    if (signals.length === 0) {
      this.root.remove();
      this.removed(this);
      return;
    }
    this.list();
    this.draw();
  }

  draw() {
    const rows = this.history.rows(this.signals);
    if (rows.length < 2) return;
    if (this.graph) return void this.graph.updateOptions({file: rows});
    this.graph = new Dygraph(this.canvas, rows, {
      labels: ['time (s)', ...this.signals],
      colors: this.signals.map((_, i) => kColours[i % kColours.length]),
      dateWindow: [-kSpan_s, 0], legend: 'follow', connectSeparatedPoints: false, axisLabelFontSize: 12,
      gridLineColor: 'rgba(128,128,128,.25)', strokeWidth: 1.5, interactionModel: {},
    });
  }
}

export class Plots {
  constructor(parent, history) {
    this.parent = parent;
    this.history = history;
    this.plots = [];
  }

  add(signals) {
    this.plots.push(new Plot(this.parent, this.history, signals.filter(name => this.history.names.includes(name)),
      plot => this.plots.splice(this.plots.indexOf(plot), 1)));
  }

  draw() {
    for (const plot of this.plots) plot.draw();
  }
}
