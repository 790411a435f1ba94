// node gltf.js NODE_MODULES FILE.glb: the report of Khronos' validator, as JSON.
const [modules, file] = process.argv.slice(2);
const { validateBytes } = require(modules + "/gltf-validator");
validateBytes(new Uint8Array(require("fs").readFileSync(file))).then((report) => console.log(JSON.stringify(report)));
