// node usd.mjs NODE_MODULES FILE.usda OUT: what TinyUSDZ and three.js find in it. JSON on stdout: the meshes with their times; in
// OUT, float32: of each mesh the points that TinyUSDZ shows, then those of all times by three.js.
import fs from "fs";
const [modules, file, out] = process.argv.slice(2);
const bytes = fs.readFileSync(file);
const say = (text) => fs.writeSync(1, text);

const { USDAParser } = await import(modules + "/three/examples/jsm/loaders/usd/USDAParser.js");
const specs = new USDAParser().parseData(bytes.toString()).specsByPath;

// TinyUSDZ is built for browsers, and refuses to start in anything else.
globalThis.window = globalThis;
globalThis.document = {};
delete globalThis.process;
globalThis.process = undefined;
const { default: start } = await import(modules + "/tinyusdz/tinyusdz.js");
const tiny = await start({ wasmBinary: fs.readFileSync(modules + "/tinyusdz/tinyusdz.wasm") });
const stage = new tiny.TinyUSDZLoaderNative();
if (!stage.loadFromBinary(new Uint8Array(bytes), "motion.usda")) throw new Error("TinyUSDZ: " + stage.error());

const meshes = [], points = [];
for (let i = 0; i < stage.numMeshes(); ++i) {
  const mesh = stage.getMesh(i), fields = specs[mesh.absPath + ".points"].fields;
  const samples = fields.timeSamples ?? { times: [], values: [] };
  const corners = Array.from(specs[mesh.absPath + ".faceVertexIndices"].fields.default);
  // TinyUSDZ parts vertices at the seams of coordinates and colors: back to those of the file, corner by corner.
  const shown = new Float32Array(fields.timeSamples ? samples.values[0].length : fields.default.length);
  corners.forEach((v, i) => shown.set(mesh.points.slice(3 * mesh.faceVertexIndices[i], 3 * mesh.faceVertexIndices[i] + 3), 3 * v));
  meshes.push({ name: mesh.primName, count: shown.length / 3, times: samples.times,
    scheme: specs[mesh.absPath + ".subdivisionScheme"].fields.default, corners,
    extents: specs[mesh.absPath + ".extent"].fields.timeSamples?.values ?? [specs[mesh.absPath + ".extent"].fields.default] });
  points.push(shown);
  for (const value of fields.timeSamples ? samples.values : [fields.default]) points.push(Float32Array.from(value));
}
fs.writeFileSync(out, Buffer.concat(points.map((p) => Buffer.from(p.buffer))));
say(JSON.stringify({ stage: specs["/"].fields, meshes }));
