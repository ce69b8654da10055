// `youbotctl export lerobot` on two teleoperations of the simulated operator, one as CSV and one as MCAP. Two readers
// of others must read what LeRobot's loader looks for, with values that are computed here from the CSV.
// usage: node dataset_test.mjs PROGRAMS SOURCES SCRATCH
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {existsSync, readdirSync, readFileSync} from 'node:fs';
import {join} from 'node:path';
import {DuckDBInstance} from '@duckdb/node-api';
import {asyncBufferFromFile, parquetMetadataAsync, parquetReadObjects} from 'hyparquet';
import {compressors} from 'hyparquet-compressors';

const [programs, sources, scratch] = process.argv.slice(2);
const run = (program, ...options) =>
  execFileSync(join(programs, program), options, {cwd: scratch, encoding: 'utf8', stdio: ['ignore', 'pipe', 'inherit']});

const fps = 30;
const task = 'follow the square, then touch the wall: 3 × „fest“';
const dataset = join(scratch, 'dataset');
for (const [name, seconds] of [['one', '30'], ['two', '36']]) {
  run('youbotd', '--config', join(sources, 'apps/youbotd/teleop.toml'), '--demo', '--virtual-time', '--duration', seconds,
    '--record', name);
  const [have, need] = existsSync(join(scratch, name, 'teleoperation.csv')) ? ['csv', 'mcap'] : ['mcap', 'csv'];
  run('youbotctl', 'convert', `${name}/teleoperation.${have}`, `${name}/teleoperation.${need}`);
}
console.log(run('youbotctl', 'export', 'lerobot', 'one', 'two/teleoperation.mcap', dataset, '--fps',
  String(fps), '--task', task));

// Names and dtypes of what the loader of LeRobot v3.0 needs, from its src/lerobot/datasets/.
const vector = (name, unit) => ['x', 'y', 'z'].map(axis => `${name}_${axis}_${unit}`);
const pose = name => [...vector(name, 'm'), ...['qw', 'qx', 'qy', 'qz'].map(part => `${name}_${part}`)];
const joints = (name, count, end) => Array.from({length: count}, (_, i) => `${name}_${i + 1}_${end}`);
const newest = {
  'observation.state': ['base_x_m', 'base_y_m', 'base_yaw_rad', ...pose('tip'), ...joints('arm', 5, 'position_rad')],
  'action': [...pose('setpoint'), 'gripper_opening_m'],
};
const mean = {
  'observation.effort': [...joints('wheel', 4, 'torque_measured_Nm'), ...joints('arm', 5, 'torque_measured_Nm')],
  'observation.wrench': [...vector('wrench_force', 'N'), ...vector('wrench_moment', 'Nm')],
  'observation.felt_force': vector('grip_force_held', 'N'),
  'truth.contact_force': vector('contact_force', 'N'),
};
const vectors = {...newest, ...mean};
const own = {timestamp: 'float32', frame_index: 'int64', episode_index: 'int64', index: 'int64', task_index: 'int64'};
const quantiles = {q01: 1, q10: 10, q50: 50, q90: 90, q99: 99};

// The frames of a recording, from its text: rows of the phase operating, at the times of the frames.
function framesOf(name) {
  const lines = readFileSync(join(scratch, name, 'teleoperation.csv'), 'utf8').split('\n')
    .filter(line => line && !line.startsWith('#'));
  const names = lines[0].split(',');
  const column = Object.fromEntries(names.map((each, i) => [each, i]));
  const rows = lines.slice(1).map(line => line.split(',').map(Number)).filter(row => row[column.phase] === 5);
  const begin_us = Math.round(rows[0][column.time_s] * 1e6);
  const at = row => Math.round(row[column.time_s] * 1e6) - begin_us;
  const frames = [];
  for (let k = 0; k * 1e6 / fps <= at(rows.at(-1)); ++k) {
    const until = rows.filter(row => at(row) <= k * 1e6 / fps);
    const since = until.filter(row => at(row) > (k - 1) * 1e6 / fps);
    const frame = {};
    for (const [feature, columns] of Object.entries(newest))
      frame[feature] = columns.map(each => until.at(-1)[column[each]]);
    for (const [feature, columns] of Object.entries(mean))
      frame[feature] = columns.map(each => since.reduce((sum, row) => sum + row[column[each]], 0) / since.length);
    frames.push(frame);
  }
  return frames;
}
const recorded = [framesOf('one'), framesOf('two')];
const expected = recorded.flatMap((frames, episode) => frames.map((frame, i) =>
  ({...frame, timestamp: i / fps, frame_index: i, episode_index: episode, task_index: 0})));

const near = (found, wanted, what) => {
  assert.equal(found.length, wanted.length, what);
  found.forEach((value, i) => assert.ok(
    Math.abs(Number(value) - wanted[i]) <= 1e-6 * Math.max(1, Math.abs(wanted[i])), `${what}[${i}]: ${value}, not ${wanted[i]}`));
};
const json = name => JSON.parse(readFileSync(join(dataset, name), 'utf8'));

// Reader 1: hyparquet.
async function read(name) {
  const file = await asyncBufferFromFile(join(dataset, name));
  return {metadata: await parquetMetadataAsync(file), rows: await parquetReadObjects({file, compressors})};
}

const info = json('meta/info.json');
const {features, ...rest} = info;
assert.deepEqual(rest, {
  codebase_version: 'v3.0', fps, total_episodes: 2, total_frames: expected.length, total_tasks: 1, chunks_size: 1000,
  data_files_size_in_mb: 100, video_files_size_in_mb: 200,
  data_path: 'data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet', video_path: null, robot_type: 'youbot',
  splits: {train: '0:2'},
});
assert.deepEqual(features, {
  ...Object.fromEntries(Object.entries(vectors).map(([name, names]) => [name, {dtype: 'float32', shape: [names.length], names}])),
  ...Object.fromEntries(Object.entries(own).map(([name, dtype]) => [name, {dtype, shape: [1], names: null}])),
});
assert.deepEqual(readdirSync(dataset, {recursive: true}).filter(name => /\.\w+$/.test(name)).sort(), [
  'data/chunk-000/file-000.parquet', 'meta/episodes/chunk-000/file-000.parquet', 'meta/info.json', 'meta/stats.json',
  'meta/tasks.parquet']);

const data = await read('data/chunk-000/file-000.parquet');
assert.deepEqual(data.metadata.row_groups.map(group => Number(group.num_rows)), recorded.map(frames => frames.length),
  'one row group for each episode');
assert.deepEqual(Object.keys(data.rows[0]), Object.keys(features), 'columns in the order of info.json');
const schema = data.metadata.schema;
for (const [name, {dtype, names}] of Object.entries(features)) {
  const at = schema.findIndex(element => element.name === name);
  const value = schema[names ? at + 2 : at];
  assert.equal(value.type, {float32: 'FLOAT', int64: 'INT64'}[dtype], name);
  assert.equal(schema[at].repetition_type, 'OPTIONAL', name);
  if (!names) continue;
  assert.equal(schema[at].converted_type, 'LIST', name);
  assert.deepEqual([schema[at + 1].name, schema[at + 1].repetition_type, value.name], ['list', 'REPEATED', 'element']);
}
assert.equal(data.rows.length, expected.length);
data.rows.forEach((row, i) => {
  for (const name of Object.keys(vectors)) near(row[name], expected[i][name], `frame ${i}, ${name}`);
  for (const name of ['timestamp', 'frame_index', 'episode_index', 'task_index'])
    near([row[name]], [expected[i][name]], `frame ${i}, ${name}`);
  assert.equal(row.index, BigInt(i));
});

// Over all frames of `rows`; of a list, for each element.
function statisticsOf(rows, name) {
  const all = rows.map(row => [row[name]].flat().map(Number));
  const each = of => all[0].map((_, d) => of(all.map(values => values[d]).sort((a, b) => a - b)));
  const average = values => values.reduce((sum, value) => sum + value, 0) / values.length;
  return {
    min: each(values => values[0]), max: each(values => values.at(-1)), mean: each(average),
    std: each(values => Math.sqrt(average(values.map(value => (value - average(values)) ** 2)))), count: [all.length],
    ...Object.fromEntries(Object.entries(quantiles).map(([q, percent]) =>
      [q, each(values => values[Math.ceil(percent * values.length / 100) - 1])])),
  };
}
const stats = json('meta/stats.json');
assert.deepEqual(Object.keys(stats), Object.keys(features));
for (const name of Object.keys(features)) {
  const wanted = statisticsOf(data.rows, name);
  assert.deepEqual(Object.keys(stats[name]), Object.keys(wanted));
  for (const [statistic, values] of Object.entries(wanted)) near(stats[name][statistic], values, `${name} ${statistic}`);
}

const tasks = await read('meta/tasks.parquet');
assert.deepEqual(tasks.rows, [{task_index: 0n, task}]);
const pandas = JSON.parse(tasks.metadata.key_value_metadata.find(({key}) => key === 'pandas').value);
assert.deepEqual(pandas.index_columns, ['task'], 'the loader takes the name of a task from the index');
assert.deepEqual(pandas.columns.map(column => column.field_name), ['task_index', 'task']);

const episodes = (await read('meta/episodes/chunk-000/file-000.parquet')).rows;
let begin = 0;
for (const [e, frames] of recorded.entries()) {
  const {tasks: names, ...row} = episodes[e];
  assert.deepEqual(names, [task]);
  const places = Object.entries(row).filter(([name]) => !name.startsWith('stats/'));
  assert.deepEqual(Object.fromEntries(places), {
    episode_index: BigInt(e), length: BigInt(frames.length), 'data/chunk_index': 0n, 'data/file_index': 0n,
    dataset_from_index: BigInt(begin), dataset_to_index: BigInt(begin + frames.length),
    'meta/episodes/chunk_index': 0n, 'meta/episodes/file_index': 0n,
  });
  const own_rows = data.rows.slice(begin, begin += frames.length);
  for (const name of Object.keys(features))
    for (const [statistic, values] of Object.entries(statisticsOf(own_rows, name)))
      near(row[`stats/${name}/${statistic}`], values, `episode ${e}, ${name} ${statistic}`);
  assert.equal(Object.keys(row).length - places.length, 10 * Object.keys(features).length);
}

// Reader 2: DuckDB, with the types that it finds and all values of the first reader.
const database = await (await DuckDBInstance.create()).connect();
const query = async text => (await database.runAndReadAll(text)).getRowObjectsJson();
const files = `'${dataset}/data/*/*.parquet'`;
const types = Object.fromEntries((await query(`describe select * from ${files}`)).map(row => [row.column_name, row.column_type]));
for (const [name, {dtype, names}] of Object.entries(features))
  assert.equal(types[name], {float32: 'FLOAT', int64: 'BIGINT'}[dtype] + (names ? '[]' : ''), name);
const rows = await query(`select * from ${files} order by index`);
assert.equal(rows.length, data.rows.length);
rows.forEach((row, i) => {
  for (const name of Object.keys(features))
    near([row[name]].flat(), [data.rows[i][name]].flat().map(Number), `DuckDB, frame ${i}, ${name}`);
});
assert.deepEqual(await query(`select * from '${dataset}/meta/tasks.parquet'`), [{task_index: '0', task}]);
const joined = await query(`select e.episode_index, count(*) as frames from '${dataset}/meta/episodes/*/*.parquet' e ` +
  `join ${files} d on d.index >= e.dataset_from_index and d.index < e.dataset_to_index and d.episode_index = e.episode_index ` +
  'where len(e."stats/action/mean") = 8 group by 1 order by 1');
assert.deepEqual(joined.map(row => Number(row.frames)), recorded.map(frames => frames.length));
console.log(`${expected.length} frames of 2 episodes: hyparquet and DuckDB read what the recordings say`);
