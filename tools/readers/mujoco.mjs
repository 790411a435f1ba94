// node mujoco.mjs NODE_MODULES FOLDER DENSITY: what MuJoCo makes of body.xml, body.urdf, the hulls, flex.xml and
// flex-interior.xml. JSON on stdout. Of body.xml, of the same without what it says of the whole ("hulls"), of body.urdf and of each
// hull by itself with that density: mass, centre and the matrix of inertia about it, in the body's frame. Of a flex its vertices,
// tets, mass, and how it falls on a plane from half its height.
import fs from "fs";
const [modules, folder, density] = process.argv.slice(2);
const { default: load } = await import(modules + "/mujoco-js/dist/mujoco_wasm.js");
const mujoco = await load();
mujoco.FS.mkdir("/hulls");
const has = (name) => fs.existsSync(folder + "/" + name);
const hulls = has("hulls") ? fs.readdirSync(folder + "/hulls").sort().map((f) => "hulls/" + f) : [];
const given = ["body.xml", "body.urdf", "flex.xml", "flex-interior.xml", "surface.obj"].filter(has);
for (const name of [...given, ...hulls]) mujoco.FS.writeFile("/" + name, fs.readFileSync(folder + "/" + name));
const model = (name, text) => {
  if (text) mujoco.FS.writeFile("/" + name, text);
  return mujoco.MjModel.loadFromXML("/" + name);
};
const text = (name) => fs.readFileSync(folder + "/" + name, "utf8");

// R diag(moments) Rᵀ, R of the quaternion of the principal axes.
function weight(model, body) {
  const m = model.body_inertia.slice(3 * body, 3 * body + 3), [w, x, y, z] = model.body_iquat.slice(4 * body, 4 * body + 4);
  const r = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
             [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
             [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]];
  const inertia = r.map((a) => r.map((b) => a[0] * m[0] * b[0] + a[1] * m[1] * b[1] + a[2] * m[2] * b[2]));
  return { mass: model.body_mass[body], center: [...model.body_ipos.slice(3 * body, 3 * body + 3)], inertia };
}

const found = {};
if (has("body.xml")) {
  const body = model("body.xml");
  found.body = { ...weight(body, 1), meshes: body.nmesh };
  found.hulls = weight(model("parts.xml", text("body.xml").replace(/<inertial [^>]*>/, "")), 1);
}
if (has("body.urdf")) {
  // By itself MuJoCo welds a robot's root to the world, and paths of meshes lose their folders.
  const kept = '<mujoco><compiler fusestatic="false" strippath="false" discardvisual="false"/></mujoco>';
  const robot = model("kept.urdf", text("body.urdf").replace(/(<robot [^>]*>)/, "$1" + kept));
  found.urdf = { ...weight(robot, 1), meshes: robot.nmesh };
}
if (hulls.length) {
  const assets = hulls.map((f, i) => `<mesh name="h${i}" file="${f}"/>`).join("");
  const bodies = hulls.map((f, i) => `<body><freejoint/><geom type="mesh" mesh="h${i}" density="${density}"/></body>`).join("");
  const apart = model("apart.xml", `<mujoco><asset>${assets}</asset><worldbody>${bodies}</worldbody></mujoco>`);
  found.each = hulls.map((f, i) => ({ file: f, ...weight(apart, i + 1) }));
}
for (const name of ["flex.xml", "flex-interior.xml"].filter(has)) found[name] = fall(name);
fs.writeSync(1, JSON.stringify(found));

// Lowered by its own height and a half onto a plane.
function fall(name) {
  const points = text(name).match(/point="([^"]*)"/)[1].trim().split(/\s+/).map(Number);
  const heights = points.filter((_, i) => i % 3 === 2);
  const low = Math.min(...heights), size = Math.max(...heights) - low;
  const world = model("fall.xml", `<mujoco><option timestep="0.0005" solver="CG" tolerance="1e-6"/><size memory="200M"/><include file="${name}"/>
<worldbody><geom type="plane" size="0 0 1" priority="1" solref="0.005 1" pos="0 0 ${low - size / 2}"/></worldbody></mujoco>`);
  const data = new mujoco.MjData(world);
  const flex = { vertices: world.nflexvert, tets: world.nflexelem, mass: world.body_subtreemass[0], low: Infinity, fastest: 0, size };
  for (let step = 0; step < 2000; ++step) {
    mujoco.mj_step(world, data);
    if (step % 50 !== 49) continue;
    const x = data.flexvert_xpos;
    for (let i = 2; i < x.length; i += 3) flex.low = Math.min(flex.low, (x[i] - (low - size / 2)) / size);
    flex.finite = data.qvel.every(Number.isFinite);
    flex.fastest = Math.max(flex.fastest, ...data.qvel.map(Math.abs));
  }
  flex.time = data.time;  // MuJoCo begins anew where it is unstable
  const x = data.flexvert_xpos;
  const ends = Array.from({ length: x.length / 3 }, (_, i) => x[3 * i + 2]);
  flex.top = (Math.max(...ends) - (low - size / 2)) / size;
  return flex;
}
