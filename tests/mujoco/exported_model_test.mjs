// Exported drive models in MuJoCo: the velocity that the engine simulates from the measured torque, in windows of a
// second that start in the measured state, against the measured one. Its error may be 1.05 times that of our own
// simulation of the same windows. Prints a table of all cases, with the file for engines that have damping and
// friction only.
// usage: node exported_model_test.mjs PROGRAMS CASES SCRATCH
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {readdirSync, readFileSync} from 'node:fs';
import {join} from 'node:path';
import load from '@mujoco/mujoco';

const [programs, cases, scratch] = process.argv.slice(2);
const mujoco = await load();
const most = 1.05;
/// Bristles, whose levels are positive, cannot be as narrow as this; the file says how far they are off. It must be
/// better than a straight line.
const approximated = ['midspeed_dip'];

function model(text) {
  try {
    return mujoco.MjModel.from_xml_string(text);
  } catch (error) {
    assert.fail(`MuJoCo refuses the file: ${error?.message ?? error}\n${text}`);
  }
}

/// rms error of the velocity [rad/s] over all windows.
function error_of(text, {period_s, commanded, windows}) {
  const drive = model(text);
  const steps = Math.max(1, Math.round(period_s / drive.opt.timestep));
  drive.opt.timestep = period_s / steps;
  const data = new mujoco.MjData(drive);
  /// Commands pass a filter before they are samples: between two, they are a line.
  function command(from, to) {
    for (let k = 0; k < steps; ++k) {
      data.ctrl[0] = from + ((k + 0.5) / steps) * (to - from);
      mujoco.mj_step(drive, data);
    }
  }
  let squares = 0;
  let samples = 0;
  for (const window of windows) {
    mujoco.mj_resetData(drive, data);
    const before = window.before ?? [];
    for (const [i, torque] of before.entries()) command(torque, before[i + 1] ?? window.torque[0]);
    data.qpos[0] = window.position;
    data.qvel[0] = window.velocity;
    if (drive.nv > 1) {
      data.qpos[1] = window.load_position ?? window.position;
      data.qvel[1] = window.load_velocity ?? window.velocity;
    }
    if (!commanded) for (let i = 0; i < drive.na; ++i) data.act[i] = window.deflection ?? 0;
    for (const [i, torque] of window.torque.entries()) {
      squares += (data.qvel[0] - window.measured[i]) ** 2;
      ++samples;
      // A measured torque has passed the actuator, with its delay.
      if (commanded) {
        command(torque, window.torque[i + 1] ?? torque);
        continue;
      }
      data.qfrc_applied[0] = torque;
      for (let k = 0; k < steps; ++k) mujoco.mj_step(drive, data);
    }
  }
  data.delete();
  drive.delete();
  return Math.sqrt(squares / samples);
}

console.log(`MuJoCo ${mujoco.mj_versionString()}; rms error of the velocity, rad/s`);
console.log('| drive | ours | drive.xml | ratio | drive_plain.xml | ratio |\n|---|---|---|---|---|---|');
const worse = [];
const names = readdirSync(cases).sort();
for (const name of names) {
  const recorded = JSON.parse(readFileSync(join(cases, name, 'windows.json'), 'utf8'));
  const out = join(scratch, name);
  execFileSync(join(programs, 'youbot-gap'), ['export', 'mujoco', join(cases, name, 'model.toml'), '--out', out, '--quiet']);
  const ours = recorded.ours_rad_per_s;
  const [native, plain] = ['drive.xml', 'drive_plain.xml'].map(file => error_of(readFileSync(join(out, file), 'utf8'), recorded));
  const row = [ours, native, native / ours, plain, plain / ours].map(value => value.toPrecision(3));
  console.log(`| ${name} | ${row.join(' | ')} |`);
  if (!(native <= (approximated.includes(name) ? plain : most * ours))) worse.push(`${name}: ${native} is too much: ours is ${ours}`);
}
assert.ok(names.length >= 1);
assert.deepEqual(worse, []);
