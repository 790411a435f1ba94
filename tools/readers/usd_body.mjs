// node usd_body.mjs NODE_MODULES FILE.usda: what TinyUSDZ and three.js find in a soft body. JSON on stdout: of each prim by its path its
// type, schemas and attributes, as three.js reads them; the meshes that TinyUSDZ shows, with how many points and triangles.
import fs from "fs";
const [modules, file] = process.argv.slice(2);
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
if (!stage.loadFromBinary(new Uint8Array(bytes), "body.usda")) throw new Error("TinyUSDZ: " + stage.error());
const meshes = [];
for (let i = 0; i < stage.numMeshes(); ++i) {
  const mesh = stage.getMesh(i);
  meshes.push({ path: mesh.absPath, points: mesh.points.length / 3, triangles: mesh.faceVertexIndices.length / 3 });
}
const plain = (value) => (ArrayBuffer.isView(value) ? Array.from(value) : value);
const prims = Object.fromEntries(Object.entries(specs).map(([path, spec]) =>
  [path, Object.fromEntries(Object.entries(spec.fields ?? {}).map(([key, value]) => [key, plain(value)]))]));
say(JSON.stringify({ meshes, prims }));
