// node mujoco.mjs NODE_MODULES FOLDER: what MuJoCo makes of body.xml and flex.xml. JSON on stdout: the body's mass, centre and
// moments of inertia and its geometry; of the flex its vertices, tets, mass, and how it falls on a plane from half its height.
import fs from "fs";
const [modules, folder] = process.argv.slice(2);
const say = (text) => fs.writeSync(1, text);
const { default: load } = await import(modules + "/mujoco-js/dist/mujoco_wasm.js");
const mujoco = await load();
mujoco.FS.mkdir("/hulls");
for (const name of ["body.xml", "flex.xml", "surface.obj", ...fs.readdirSync(folder + "/hulls").map((f) => "hulls/" + f)])
  mujoco.FS.writeFile("/" + name, fs.readFileSync(folder + "/" + name));

const body = mujoco.MjModel.loadFromXML("/body.xml");
const found = {
  mass: body.body_mass[1], center: [...body.body_ipos.slice(3, 6)], moments: [...body.body_inertia.slice(3, 6)], meshes: body.nmesh, geoms: body.ngeom,
};

// Lowered by its own height and a half onto a plane.
const text = fs.readFileSync(folder + "/flex.xml", "utf8");
const points = text.match(/point="([^"]*)"/)[1].trim().split(/\s+/).map(Number);
const heights = points.filter((_, i) => i % 3 === 2);
const low = Math.min(...heights), size = Math.max(...heights) - low;
mujoco.FS.writeFile("/fall.xml", `<mujoco><option timestep="0.0005" solver="CG" tolerance="1e-6"/><size memory="200M"/><include file="flex.xml"/>
<worldbody><geom type="plane" size="0 0 1" priority="1" solref="0.005 1" pos="0 0 ${low - size / 2}"/></worldbody></mujoco>`);
const model = mujoco.MjModel.loadFromXML("/fall.xml");
const data = new mujoco.MjData(model);
found.flex = { vertices: model.nflexvert, tets: model.nflexelem, mass: model.body_subtreemass[0], low: Infinity, fastest: 0, size };
for (let step = 0; step < 2000; ++step) {
  mujoco.mj_step(model, data);
  if (step % 50 !== 49) continue;
  const x = data.flexvert_xpos;
  for (let i = 2; i < x.length; i += 3) found.flex.low = Math.min(found.flex.low, (x[i] - (low - size / 2)) / size);
  found.flex.finite = data.qvel.every(Number.isFinite);
  found.flex.fastest = Math.max(found.flex.fastest, ...data.qvel.map(Math.abs));
}
found.flex.time = data.time;  // MuJoCo begins anew where it is unstable
const x = data.flexvert_xpos;
const ends = Array.from({ length: x.length / 3 }, (_, i) => x[3 * i + 2]);
found.flex.top = (Math.max(...ends) - (low - size / 2)) / size;
say(JSON.stringify(found));
