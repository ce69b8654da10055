// The page of youbotd: what the robot does, and a button that stops it.
import {connect, json, numbers} from './stream.js';
import {createRobot} from './robot.js';
import {History, Plots} from './plots.js';

const kRate_Hz = 100;
const kPlot_ms = 100;
const kStale_ms = 1000;
const kAlive_ms = 100;
const kCertain_ms = 3000;
const kGood = 'good', kWarn = 'warn', kBad = 'bad';
const at = id => document.getElementById(id);
const show = (id, visible) => { at(id).hidden = !visible; };
const text = (id, content) => { if (at(id).textContent !== content) at(id).textContent = content; };

// stop.js has the functions complain() and stop().
async function load_info() {
  for (;;) {
    try {
      return await (await fetch('info.json')).json();
    } catch {
      await new Promise(resolve => setTimeout(resolve, kStale_ms));
    }
  }
}
const info = await load_info();
const history = new History(info.columns, kRate_Hz);
const plots = new Plots(at('plots'), history);
const kNoToken = at('no-token').textContent;
let record = null;   // newest values by name
let status = {};
let connected = false;
let heard_ms = 0;
let commander;

// --- State ----------------------------------------------------------------------------------------------------------

function is_fresh() {
  return connected && performance.now() - heard_ms < kStale_ms;
}

function describe_state() {
  const fault = status.fault && !status.fault_acknowledged;
  if (status.ended)
    return fault ? [kBad, `The run was stopped by a fault at ${status.fault}`] : [kWarn, 'The run has ended'];
  if (!connected) return [kBad, 'No connection to youbotd: what is shown is old'];
  if (record === null) return [kWarn, 'Waiting for the robot'];
  if (!is_fresh()) return [kBad, 'No data for more than 1 s: the network or the cycle of youbotd has stopped'];
  if (fault) return [kBad, `Stopped by a fault at ${status.fault}`];
  const who = status.commander ? `, commanded by ${status.commander}` : '';
  if (status.enabled) return [kGood, `${status.mode}: ${status.phase}${who}`];
  return [kWarn, 'Drives off'];
}

function reasons() {
  const list = [];
  if (!connected || !status.format || status.enabled || status.ended) return list;
  if (status.fault && !status.fault_acknowledged)
    list.push({found: `the last run was stopped by a fault at ${status.fault}`, remedy: 'acknowledge it: youbotctl acknowledge'});
  if (status.robot_state && status.robot_state !== 'ready') list.push({found: `robot: ${status.robot_state}`});
  if (status.master_state && status.master_state !== 'ready')
    list.push({found: `haptic device: ${status.master_state}`});
  for (const line of status.robot_trouble ?? []) list.push({found: line});
  list.push(...info.checks.filter(({mark}) => mark === 'fail')
    .map(({found, remedy}) => ({found: `when youbotd started: ${found}`, remedy})));
  if (list.length === 0) list.push({found: 'nothing is in the way: it waits for an enable'});
  return [...list, ...info.checks.filter(({mark}) => mark === 'warn')
    .map(({found, remedy}) => ({found: `warning: ${found}`, remedy}))];
}

function element(tag, content, name) {
  const made = document.createElement(tag);
  made.textContent = content;
  if (name) made.className = name;
  return made;
}

function show_reasons() {
  const list = reasons();
  show('why', list.length > 0);
  const items = list.flatMap(({found, remedy}) => [element('li', found), ...(remedy ? [element('li', remedy, 'remedy')] : [])]);
  const before = at('reasons').textContent;
  if (before !== items.map(item => item.textContent).join('')) at('reasons').replaceChildren(...items);
}

// --- Joints ---------------------------------------------------------------------------------------------------------

const kUnlimited = 1e6;
const column_of = name => name.replace('-', '_');
const rows = [];

function number(value, digits) {
  return Number.isFinite(value) ? value.toFixed(digits).replace(/^-(0\.0*)$/, '$1') : '–';
}

function make_joints() {
  for (const joint of info.joints) {
    const row = document.createElement('tr');
    row.innerHTML = '<td></td><td class="number"></td><td class="wide"><div class="bar range"><s></s></div></td>' +
      '<td class="number"></td><td class="number"></td><td class="wide"><div class="bar torque"><b></b></div></td>';
    row.cells[0].textContent = joint.name;
    at('joints').append(row);
    rows.push({row, joint, position: row.querySelector('.range'), torque: row.querySelector('.torque')});
    const ranged = Number.isFinite(joint.lower_rad) && Math.abs(joint.upper_rad - joint.lower_rad) < kUnlimited;
    if (!ranged) row.cells[2].textContent = '';
  }
}

function show_joints() {
  const faults = (status.robot_trouble ?? []).map(line => line.split(': ')[0]);
  for (const {row, joint, position, torque} of rows) {
    const name = column_of(joint.name);
    const position_rad = record[`${name}_position_rad`];
    const measured_Nm = record[`${name}_torque_measured_Nm`];
    const torque_command = record[`${name}_torque_command_Nm`];
    const command = torque_command ?? record[`${name}_command`];
    const unit = torque_command !== undefined || record.arm_mode === 1 ? 'N·m' : 'rad';
    row.cells[1].textContent = `${number(position_rad, 3)} rad`;
    row.cells[3].textContent = `${number(command, 3)} ${unit}`;
    row.cells[4].textContent = `${number(measured_Nm, 3)} N·m`;
    row.classList.toggle('fault', faults.includes(joint.name));
    if (position.isConnected) {
      const share = (position_rad - joint.lower_rad) / (joint.upper_rad - joint.lower_rad);
      position.querySelector('s').style.left = `${100 * Math.min(Math.max(share, 0), 1)}%`;
      position.classList.toggle('near', share < .05 || share > .95);
    }
    const share = joint.torque_limit_Nm ? Math.min(Math.abs(measured_Nm) / joint.torque_limit_Nm, 1) : 0;
    const bar = torque.querySelector('b');
    bar.style.left = measured_Nm < 0 ? `${50 - 50 * share}%` : '50%';
    bar.style.width = `${50 * share}%`;
    torque.classList.toggle('near', share > .9);
  }
}

// --- Hand, bus, cycle, fault ----------------------------------------------------------------------------------------

function show_hand() {
  const force = ['x', 'y', 'z'].map(axis => record[`grip_force_held_${axis}_N`]);
  const felt_N = Math.hypot(...force);
  if (Number.isFinite(felt_N)) at('felt').value = felt_N;
  text('felt-text', `${number(felt_N, 2)} N`);
  if (Number.isFinite(record.tank_J)) {
    at('tank').max = Math.max(at('tank').max, record.tank_J);
    at('tank').value = record.tank_J;
  }
  text('tank-text', `${number(record.tank_J, 3)} J`);
}

const svg = (tag, attributes, content = '') => {
  const made = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.textContent = content;
  return made;
};

// In the order of the bus. A link is broken before the first of those that are lost up to the end.
let drawn_bus = '';
function show_bus() {
  const devices = status.devices ?? [];
  const picture = JSON.stringify(devices);
  if (picture === drawn_bus && drawn_bus !== '') return;
  drawn_bus = picture;
  show('bus-section', devices.length > 0);
  let lost_from = devices.length;
  while (lost_from > 0 && !devices[lost_from - 1].answers) --lost_from;
  const pitch = 26;
  const drawing = svg('svg', {viewBox: `0 0 320 ${pitch * (devices.length + 1)}`, role: 'img',
    'aria-label': 'devices in the order of the bus'});
  [{name: 'youbotd', works: true}, ...devices].forEach((device, i) => {
    const y = pitch * (i + .5);
    const broken = i === lost_from + 1;
    if (i > 0) drawing.append(svg('line', {x1: 14, x2: 14, y1: y - pitch + 7, y2: y - 7, 'stroke-width': 2.5,
      stroke: broken ? 'var(--bad)' : 'var(--faint)', 'stroke-dasharray': broken ? '3 4' : 'none',
      class: broken ? 'broken' : 'link'}));
    drawing.append(svg('circle', {cx: 14, cy: y, r: 6, fill: device.works ? 'var(--good)' : 'var(--bad)'}));
    drawing.append(svg('text', {x: 30, y: y + 4}, device.works ? device.name : `${device.name}: not in operation`));
    if (broken) drawing.append(svg('text', {x: 180, y: y - pitch / 2 + 4, class: 'broken'}, 'no link from here on'));
  });
  at('bus').replaceChildren(drawing);
}

function show_losses() {
  const bus = status.bus;
  text('losses', bus ? `${bus.bridged_of_1000_cycles} of the last 1000 cycles had no whole answer` : '');
}

function show_cycle() {
  const times = status.cycle_us;
  if (!times || document.hidden) return;
  const count = times.step.length;
  const most = Math.max(1, ...times.step, ...times.wake_up);
  const height = value => value === 0 ? 0 : 4 + 66 * Math.log(value) / Math.log(Math.max(most, 10));
  const width = 320 / count;
  const drawing = svg('svg', {viewBox: '0 0 320 104', role: 'img', 'aria-label': 'cycles by duration, logarithmic'});
  for (let i = 0; i < count; ++i) {
    for (const [name, fill, offset] of [['wake_up', 'var(--bar)', 0], ['step', 'var(--accent)', .5]]) {
      const h = height(times[name][i]);
      const bar = svg('rect', {x: (i + offset) * width, y: 80 - h, width: width * .45, height: h, fill});
      bar.append(svg('title', {}, `${times[name][i]} cycles`));
      drawing.append(bar);
    }
    if (i % 3 === 0 && i < times.bounds.length) {
      const bound = times.bounds[i];
      drawing.append(svg('text', {x: (i + 1) * width, y: 96, 'text-anchor': 'middle'},
        bound < 1000 ? `${bound} µs` : `${bound / 1000} ms`));
    }
  }
  at('cycle').replaceChildren(drawing);
}

function show_fault() {
  show('fault-section', Boolean(status.fault));
  text('fault', status.fault ?? '');
  show('fault-report', connected && Boolean(status.fault_report));
  show('fault-frames', Boolean(status.fault_frames));
}

// --- 3D -------------------------------------------------------------------------------------------------------------

function positions() {
  const base = record.base_x_m !== undefined ? 'base' : 'odometry';
  const all = {base_x: record[`${base}_x_m`], base_y: record[`${base}_y_m`], base_yaw: record[`${base}_yaw_rad`]};
  for (let i = 1; i <= 5; ++i) all[`arm_joint_${i}`] = record[`arm_${i}_position_rad`];
  return all;
}

const vector_of = (name, unit) => ['x', 'y', 'z'].map(axis => record[`${name}_${axis}_${unit}`]);

function show_robot(robot) {
  if (info.teleoperated) {
    robot.show(positions(), status.enabled ? vector_of('setpoint', 'm') : null, vector_of('wrench_force', 'N'),
      robot.place_of('tip'));
    return;
  }
  const yaw = record.odometry_yaw_rad;
  const [x, y] = [record.force_x_N, record.force_y_N];
  const force_W = [x * Math.cos(yaw) - y * Math.sin(yaw), x * Math.sin(yaw) + y * Math.cos(yaw), 0];
  robot.show(positions(), status.enabled ? [record.reference_x_m, record.reference_y_m, .05] : null, force_W,
    robot.place_of('base_link'));
}

async function start_3d() {
  try {
    const robot = await createRobot(at('view'), info.workspace);
    if (!info.teleoperated) robot.hide('arm_foot');
    const frame = () => {
      if (record) show_robot(robot);
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  } catch (error) {
    at('view').replaceChildren(element('p', `No 3D view: ${error.message}`));
  }
}

// --- Commands -------------------------------------------------------------------------------------------------------

function take_token() {
  const given = new URLSearchParams(location.hash.slice(1)).get('token');
  if (given) {
    sessionStorage.setItem('token', given);
    window.history.replaceState(null, '', location.pathname);  // not in bookmarks and screenshots
  }
  return sessionStorage.getItem('token');
}

class Commander {
  constructor(token) {
    this.token = token;
    this.name = null;  // by which the status lists this page as the commander
    this.drive = null;
    this.open();
    setInterval(() => this.beat(), kAlive_ms);
  }

  open() {
    this.socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/control`);
    this.socket.onopen = () => this.socket.send(`token ${this.token}`);
    this.socket.onmessage = ({data}) => {
      const answer = JSON.parse(data);
      if (answer.ok && answer.name) {
        this.name = answer.name;
        show_commands(true);
      }
      if (answer.ok) return;
      complain(answer.error);
      if (this.name !== null) return;
      sessionStorage.removeItem('token');  // of an earlier start
      this.refused = true;
      show_commands(false, kNoToken);
    };
    this.socket.onclose = () => {
      this.name = null;
      if (this.refused) return;
      show_commands(false, 'Not connected.');
      setTimeout(() => this.open(), 1000);
    };
  }

  // youbotd refuses an enable that may have waited in the network (freshness.h).
  ask(request) {
    const usable = connected && this.socket.readyState === WebSocket.OPEN;
    complain(usable ? '' : 'No connection to youbotd: try again.');
    if (usable) this.socket.send(request);
  }

  commands() {
    return this.name !== null && status.commander === this.name;
  }

  // The commander's sign of life. A page that is hidden or gets no data gives none, and the robot comes to rest.
  // None waits for the connection: it would come too late.
  beat() {
    if (!this.name || document.hidden || !is_fresh() || this.socket.bufferedAmount > 0) return;
    const drives = this.drive && this.commands() && status.phase === 'running';
    this.socket.send(drives ? `set velocity ${this.drive.join(' ')}` : 'alive');
  }
}

function show_commands(usable, why = kNoToken) {
  show('with-token', usable);
  text('no-token', why);
  show('no-token', !usable);
}

function start_commands() {
  show('commands', info.commanded);
  const token = take_token();
  if (!info.commanded || !token) return;
  const commander = new Commander(token);
  at('mode').replaceChildren(...info.modes.map(mode => element('option', mode)));
  at('mode').onchange = () => commander.ask(`mode ${at('mode').value}`);
  at('enable').onclick = () => {
    commander.drive = null;
    commander.ask('enable');
  };
  at('disable').onclick = () => {
    const certain = !info.teleoperated || at('disable').dataset.certain;
    if (certain) commander.ask('disable');
    at('disable').dataset.certain = certain ? '' : 'yes';
    text('disable', certain ? 'Drives off' : 'The arm falls: press again');
    if (!certain) setTimeout(() => {
      at('disable').dataset.certain = '';
      text('disable', 'Drives off');
    }, kCertain_ms);
  };
  at('acknowledge').onclick = () => commander.ask('acknowledge');
  const halt = () => { if (commander.drive) commander.drive = [0, 0, 0]; };
  const speed = () => Number(at('speed').value);
  at('speed').oninput = () => text('speed-text', `${speed().toFixed(2)} m/s`);
  for (const button of document.querySelectorAll('[data-drive]')) {
    const direction = button.dataset.drive.split(' ').map(Number);
    button.onpointerdown = event => {
      if (event.button !== 0 || !event.isPrimary) return;
      button.setPointerCapture(event.pointerId);
      commander.drive = [direction[0] * speed(), direction[1] * speed(), direction[2] * 2 * speed()];
    };
    button.onpointerup = button.onpointercancel = button.onlostpointercapture = halt;
    button.oncontextmenu = event => event.preventDefault();  // of a long press
  }
  addEventListener('blur', halt);
  document.addEventListener('visibilitychange', halt);
  at('stop').addEventListener('click', () => { commander.drive = null; });
  return commander;
}

// --- All together ---------------------------------------------------------------------------------------------------

function show_status() {
  const [level, what] = describe_state();
  at('state').dataset.level = level;
  text('state', what);
  show_reasons();
  show_bus();
  show_losses();
  show_cycle();
  show_fault();
  const commands = Boolean(status.enabled && commander?.commands());
  show('hold', commands);
  show('drive', commands && status.mode === 'velocity');
  if (status.mode && document.activeElement !== at('mode')) at('mode').value = status.mode;
}

commander = start_commands();
make_joints();
show('hand', info.teleoperated);
text('version', `youbotd ${info.version}`);
text('stream-address', `ws://${location.host}/`);
at('foxglove').href =
  `https://app.foxglove.dev/~/view?ds=foxglove-websocket&ds.url=${encodeURIComponent(`ws://${location.host}/`)}`;
at('signals').replaceChildren(...info.columns.map(name => {
  const option = document.createElement('option');
  option.value = name;
  return option;
}));
at('add-plot').onclick = () => plots.add([info.columns.find(name => name.endsWith('_torque_measured_Nm'))]);
if (info.teleoperated) {
  plots.add(['grip_force_held_x_N', 'grip_force_held_y_N', 'grip_force_held_z_N']);
  plots.add(['setpoint_x_m', 'tip_x_m', 'setpoint_z_m', 'tip_z_m']);
} else {
  plots.add(['reference_x_m', 'odometry_x_m', 'reference_y_m', 'odometry_y_m']);
  plots.add(['wheel_1_torque_command_Nm', 'wheel_2_torque_command_Nm', 'wheel_3_torque_command_Nm',
    'wheel_4_torque_command_Nm']);
}
connect({
  '/youbot/record': (time_s, payload) => {
    const values = numbers(payload, info.columns.length);
    history.add(time_s, values);
    heard_ms = performance.now();
    record = Object.fromEntries(info.columns.map((name, i) => [name, values[i]]));
  },
  '/youbot/status': (_, payload) => {
    status = json(payload);
    show_status();
  },
}, now => {
  connected = now;
  show_status();
});
setInterval(() => {
  if (document.hidden || !record) return;
  plots.draw();
  show_joints();
  if (info.teleoperated) show_hand();
}, kPlot_ms);
setInterval(async () => {
  show_status();
  if (info.joints.length > 0 || !connected) return;
  const {joints} = await load_info();  // the robot was not open yet
  if (info.joints.length > 0) return;
  info.joints = joints;
  make_joints();
}, kStale_ms);
start_3d();
