// Exported arms in MuJoCo, on recordings. Two errors, each of which may be 1.05 times that of our own model:
// torque: what the engine needs for the recorded motion (inverse dynamics), against the recorded torque, where all
// joints move; velocity: what it simulates from the recorded torque in windows of a tenth of a second, which start in
// the recorded state, against the recorded velocity. Prints a table of all cases, with the plain file and the URDF.
// usage: node exported_arm_test.mjs PROGRAMS CASES SCRATCH
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync, readdirSync, readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import load from '@mujoco/mujoco';

const [programs, cases, scratch] = process.argv.slice(2);
const mujoco = await load();
const most = 1.05;
/// Slower joints may be at rest, where friction is any torque up to its breakaway.
const moving = 0.05;
/// Friction that changes with the load has no place in MuJoCo: Coulomb friction stands for it.
const lossy = ['two_link_arm_load_friction'];

/// Arms without an effect that URDF has no place for.
const whole_in_urdf = ['dart_planar'];

/// A loaded file, with its joints in the order of the arm.
class Arm {
  constructor(text) {
    try {
      this.model = mujoco.MjModel.from_xml_string(text);
    } catch (error) {
      assert.fail(`MuJoCo refuses the file: ${error?.message ?? error}\n${text}`);
    }
    // MuJoCo's own reader of URDF makes joints without motors, and friction that yields.
    const is_urdf = text.includes('<robot ');
    if (is_urdf) {
      this.model.opt.timestep = 5e-4;
      for (let i = 0; i < this.model.nv; ++i) {
        this.model.dof_solref.set([1e-3, 1], 2 * i);
        this.model.dof_solimp.set([0.9999, 0.9999, 0.001], 5 * i);
      }
    }
    this.data = new mujoco.MjData(this.model);
    const joints = [...text.matchAll(/<joint [^>]*?name="([^"]*)"/g)].map(match => match[1]).filter(name => !is_urdf || text.includes(`<joint name="${name}" type="continuous"`));
    const motors = [...text.matchAll(is_urdf ? /<joint name="([^"]*)" type="continuous"/g : /<motor name="([^"]*)" joint="[^"]*" gear="([^"]*)"/g)];
    this.gear = motors.map(match => Number(match[2] ?? 1));
    this.dof = motors.map(match => joints.indexOf(match[1]));
    this.link_dof = motors.map(match => joints.indexOf(`${match[1]}_link`));
    this.unbalanced = [];
    this.bristles = [...text.matchAll(/joint="([^"]*)"[^>]*lugre="([^"]*)"/g)].map(match => {
      const [stiffness, , sliding, rest, speed] = match[2].split(' ').map(Number);
      return {dof: joints.indexOf(match[1]), deflection: v =>
        Math.sign(v) * (sliding + (rest - sliding) * Math.exp(-((v / speed) ** 2))) / stiffness};
    });
  }
  put(motion, i) {
    const {qpos, qvel, act} = this.data;
    for (const [j, at] of this.dof.entries()) {
      qpos[at] = motion.q[i][j];
      qvel[at] = motion.v[i][j];
      const link = this.link_dof[j];
      if (link < 0) continue;
      qpos[link] = motion.link_q[i][j];
      qvel[link] = motion.link_v[i][j];
    }
    for (const [k, bristle] of this.bristles.entries()) act[k] = bristle.deflection(qvel[bristle.dof]);
  }
  /// Torques that the motors report in this state. Behind a spring the link is left with what the spring does not
  /// carry, its damping and an error of second order: `unbalanced`.
  inverse(motion, i) {
    mujoco.mj_resetData(this.model, this.data);
    this.put(motion, i);
    mujoco.mj_forward(this.model, this.data);  // without motors: what the passive actuators do
    const passive = Array.from(this.data.qfrc_actuator);
    for (const [j, at] of this.dof.entries()) {
      this.data.qacc[at] = motion.a[i][j];
      if (this.link_dof[j] >= 0) this.data.qacc[this.link_dof[j]] = motion.link_a[i][j];
    }
    mujoco.mj_inverse(this.model, this.data);
    const torque = this.dof.map(at => this.data.qfrc_inverse[at] - passive[at]);
    for (const [j, link] of this.link_dof.entries()) {
      if (link < 0) continue;
      const left = this.data.qfrc_inverse[link] - passive[link];
      this.unbalanced.push((left / (torque[j] + left)) ** 2);
      torque[j] += left;
    }
    return torque.map((one, j) => one / this.gear[j]);
  }
  /// Squared errors of the velocity in one window.
  window(motion, first) {
    const steps = Math.max(1, Math.round(motion.period_s / this.model.opt.timestep));
    this.model.opt.timestep = motion.period_s / steps;
    mujoco.mj_resetData(this.model, this.data);
    this.put(motion, first);
    const squares = [];
    for (let i = first; i < first + motion.window_samples; ++i) {
      for (const [j, torque] of motion.torque[i].entries()) this.data.ctrl[j] = torque;
      for (let k = 0; k < steps; ++k) mujoco.mj_step(this.model, this.data);
      squares.push(this.dof.reduce((sum, at, j) => sum + (this.data.qvel[at] - motion.v[i + 1][j]) ** 2, 0));
    }
    return squares;
  }
  delete() {
    this.data.delete();
    this.model.delete();
  }
}

const rms = squares => Math.sqrt(squares.reduce((sum, one) => sum + one, 0) / squares.length);

function errors_of(text, motions) {
  const arm = new Arm(text);
  const torque = [];
  const velocity = [];
  for (const motion of motions) {
    for (const [i, speeds] of motion.v.entries()) {
      if (speeds.some(v => Math.abs(v) < moving)) continue;
      for (const [j, predicted] of arm.inverse(motion, i).entries()) torque.push((predicted - motion.torque[i][j]) ** 2);
    }
    if (arm.model.nu > 0) for (const first of motion.windows) velocity.push(...arm.window(motion, first));
  }
  arm.unbalanced.sort((a, b) => a - b);
  const share = Math.sqrt(arm.unbalanced[Math.floor(arm.unbalanced.length / 2)] ?? 0);
  assert.ok(share < 0.02, `a spring leaves ${share} of the torque of its link to others`);
  arm.delete();
  return {torque: rms(torque), velocity: velocity.length ? rms(velocity) : NaN};
}

function our_torque_error(motions) {
  const squares = [];
  for (const motion of motions)
    for (const [i, speeds] of motion.v.entries())
      if (!speeds.some(v => Math.abs(v) < moving))
        for (const [j, predicted] of motion.ours[i].entries()) squares.push((predicted - motion.torque[i][j]) ** 2);
  return rms(squares);
}

console.log(`MuJoCo ${mujoco.mj_versionString()}; rms error of torque, N·m, and of velocity, rad/s`);
console.log('| arm | torque, ours | robot.xml | robot_plain.xml | robot.urdf | velocity, ours | robot.xml | robot_plain.xml |');
console.log('|---|---|---|---|---|---|---|---|');
const worse = [];
const names = readdirSync(cases).sort();

/// MuJoCo has a body `world` of its own: the export renames a base of that name.
const on_world = join(scratch, 'on_world');
mkdirSync(on_world, {recursive: true});
for (const file of ['arm.urdf', 'robot.toml'])
  writeFileSync(join(on_world, file), readFileSync(join(cases, names[0], file), 'utf8').replaceAll(/(["'])base\1/g, '"world"'));
execFileSync(join(programs, 'youbot-gap'), ['export', 'mujoco', join(on_world, 'robot.toml'), '--out', on_world, '--quiet']);
new Arm(readFileSync(join(on_world, 'robot.xml'), 'utf8')).delete();

for (const name of names) {
  const {motions, ours_rad_per_s} = JSON.parse(readFileSync(join(cases, name, 'motions.json'), 'utf8'));
  const out = join(scratch, name);
  for (const format of ['mujoco', 'urdf'])
    execFileSync(join(programs, 'youbot-gap'), ['export', format, join(cases, name, 'robot.toml'), '--out', out, '--quiet']);
  const [native, plain, urdf] = ['robot.xml', 'robot_plain.xml', 'robot.urdf'].map(file => errors_of(readFileSync(join(out, file), 'utf8'), motions));
  const ours = {torque: our_torque_error(motions), velocity: ours_rad_per_s};
  const times = (which, what) => Number.isNaN(which[what]) ? '' : `${(which[what] / ours[what]).toFixed(3)} times`;
  const cells = [ours.torque.toPrecision(3), ...[native, plain, urdf].map(which => times(which, 'torque')),
    Number.isNaN(native.velocity) ? '' : ours.velocity.toPrecision(3), ...[native, plain].map(which => times(which, 'velocity'))];
  console.log(`| ${name} | ${cells.join(' | ')} |`);
  for (const what of ['torque', 'velocity'])
    if (!lossy.includes(name) && native[what] > most * ours[what]) worse.push(`${name}: ${what} ${native[what]} is too much: ours is ${ours[what]}`);
  if (whole_in_urdf.includes(name) && urdf.torque > most * ours.torque) worse.push(`${name}: torque of the URDF ${urdf.torque} is too much: ours is ${ours.torque}`);
}
assert.ok(names.length >= 7);
assert.deepEqual(worse, []);
