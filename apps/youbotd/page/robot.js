// The robot in 3D, from its URDF: boxes, cylinders and spheres. Scripts of three.js are loaded before.
const kSetpoint = 0x1f9d55;
const kForce = 0xd9480f;
const kLimit = 0x7048e8;
const kMetresPerNewton = 0.02;

const numbers = text => (text ?? '0 0 0').trim().split(/\s+/).map(Number);

function place(object, origin) {
  object.position.set(...numbers(origin?.getAttribute('xyz')));
  const [roll, pitch, yaw] = numbers(origin?.getAttribute('rpy'));
  object.rotation.set(roll, pitch, yaw, 'ZYX');
}

function geometry(element) {
  const shape = element.firstElementChild;
  const size = name => Number(shape.getAttribute(name));
  if (shape.tagName === 'box') return new THREE.BoxGeometry(...numbers(shape.getAttribute('size')));
  if (shape.tagName === 'sphere') return new THREE.SphereGeometry(size('radius'), 24, 16);
  if (shape.tagName !== 'cylinder') return null;
  // URDF's cylinder lies along z, that of three.js along y.
  return new THREE.CylinderGeometry(size('radius'), size('radius'), size('length'), 32).rotateX(Math.PI / 2);
}

function build(urdf) {
  const links = {};
  const joints = {};
  for (const link of urdf.querySelectorAll('robot > link')) {
    const group = links[link.getAttribute('name')] = new THREE.Group();
    for (const visual of link.querySelectorAll('visual')) {
      const shape = geometry(visual.querySelector('geometry'));
      if (!shape) continue;
      const [red, green, blue] = numbers(visual.querySelector('color')?.getAttribute('rgba') ?? '.6 .6 .6 1');
      const mesh = new THREE.Mesh(shape, new THREE.MeshLambertMaterial({color: new THREE.Color(red, green, blue)}));
      place(mesh, visual.querySelector('origin'));
      group.add(mesh);
    }
  }
  const children = new Set();
  for (const joint of urdf.querySelectorAll('robot > joint')) {
    const outer = new THREE.Group();
    place(outer, joint.querySelector('origin'));
    const moved = new THREE.Group();
    const child = joint.querySelector('child').getAttribute('link');
    children.add(child);
    moved.add(links[child]);
    outer.add(moved);
    links[joint.querySelector('parent').getAttribute('link')].add(outer);
    const axis = new THREE.Vector3(...numbers(joint.querySelector('axis')?.getAttribute('xyz') ?? '1 0 0'));
    joints[joint.getAttribute('name')] = joint.getAttribute('type') === 'prismatic'
      ? value => moved.position.copy(axis).multiplyScalar(value)
      : value => moved.quaternion.setFromAxisAngle(axis, value);
  }
  const root = Object.keys(links).find(name => !children.has(name));
  return {root: links[root], links, joints};
}

function box(limits, flat) {
  const [lower, upper] = limits;
  const size = upper.map((value, i) => value - lower[i]);
  const shape = new THREE.BoxGeometry(size[0], size[1], flat ? 0.01 : size[2]);
  const lines = new THREE.LineSegments(new THREE.EdgesGeometry(shape),
    new THREE.LineDashedMaterial({color: kLimit, dashSize: .06, gapSize: .04}));
  lines.computeLineDistances();
  lines.position.set((lower[0] + upper[0]) / 2, (lower[1] + upper[1]) / 2, flat ? 0 : (lower[2] + upper[2]) / 2);
  return lines;
}

// Squares of half a metre. In short pieces: some renderers drop a line that passes the camera.
function floor() {
  const reach = 20, size = .5;
  const points = [];
  for (let i = -reach; i <= reach; ++i) {
    for (let j = -reach; j < reach; ++j) {
      points.push(new THREE.Vector3(i * size, j * size, 0), new THREE.Vector3(i * size, (j + 1) * size, 0));
      points.push(new THREE.Vector3(j * size, i * size, 0), new THREE.Vector3((j + 1) * size, i * size, 0));
    }
  }
  return new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(points),
    new THREE.LineBasicMaterial({color: 0x9aa5b5}));
}

// Throws without WebGL.
export async function createRobot(place_of_view, workspace) {
  const text = await (await fetch('robot.urdf')).text();
  const robot = build(new DOMParser().parseFromString(text, 'application/xml'));
  const scene = new THREE.Scene();
  scene.add(robot.root, new THREE.HemisphereLight(0xffffff, 0x8890a0, 1.0));
  const sun = new THREE.DirectionalLight(0xffffff, .45);
  sun.position.set(2, -3, 5);
  scene.add(sun);
  scene.add(floor());
  if (workspace?.base) scene.add(box(workspace.base, true));
  if (workspace?.end_effector) scene.add(box(workspace.end_effector, false));
  const setpoint = new THREE.Mesh(new THREE.SphereGeometry(.025, 20, 14),
    new THREE.MeshBasicMaterial({color: kSetpoint, transparent: true, opacity: .75}));
  const force = new THREE.ArrowHelper(new THREE.Vector3(1, 0, 0), new THREE.Vector3(), .1, kForce, .05, .03);
  setpoint.visible = force.visible = false;
  scene.add(setpoint, force);

  const renderer = new THREE.WebGLRenderer({antialias: true, alpha: true});
  place_of_view.append(renderer.domElement);
  renderer.domElement.setAttribute('role', 'img');
  renderer.domElement.setAttribute('aria-label', 'the robot in its present position; drag to look from elsewhere');
  const camera = new THREE.PerspectiveCamera(40, 1, .05, 60);
  camera.up.set(0, 0, 1);
  camera.position.set(1.5, -1.7, 1.15);
  const orbit = new THREE.OrbitControls(camera, renderer.domElement);
  orbit.target.set(.2, 0, .25);
  const base = robot.links.base_footprint;
  const before = new THREE.Vector3();

  function resize() {
    const {clientWidth: width, clientHeight: height} = place_of_view;
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(width, height);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
  }
  new ResizeObserver(resize).observe(place_of_view);
  resize();

  const vector = v => new THREE.Vector3(...v);
  return {
    // Joint positions by the URDF's names; set-point, and force with the place where it acts, in W or null.
    show(positions, setpoint_W, force_W, at_W) {
      for (const [name, value] of Object.entries(positions)) if (Number.isFinite(value)) robot.joints[name]?.(value);
      setpoint.visible = Boolean(setpoint_W?.every(Number.isFinite));
      if (setpoint.visible) setpoint.position.set(...setpoint_W);
      const length = force_W?.every(Number.isFinite) ? Math.hypot(...force_W) : 0;
      force.visible = length > .2;
      if (force.visible) {
        force.position.set(...at_W);
        force.setDirection(vector(force_W).normalize());
        force.setLength(Math.max(.06, kMetresPerNewton * length), .05, .03);
      }
      // The camera goes with the base.
      robot.root.updateMatrixWorld();
      const now = base.getWorldPosition(new THREE.Vector3());
      const step = now.clone().sub(before);
      camera.position.add(step);
      orbit.target.add(step);
      before.copy(now);
      orbit.update();
      renderer.render(scene, camera);
    },
    hide(link) {
      robot.links[link].visible = false;
    },
    place_of(link) {
      return robot.links[link].getWorldPosition(new THREE.Vector3()).toArray();
    },
  };
}
