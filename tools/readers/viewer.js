// node viewer.js REPORT.html OUT: what limber/detail/report/viewer.js makes of a page of `limber report`. OUT gets float32: the points of each
// body that moves at each frame, body after body.
const fs = require("fs"), path = require("path"), vm = require("vm");
const [page, out] = process.argv.slice(2), html = fs.readFileSync(page, "utf8");
const text = (id) => html.match(new RegExp(`id="${id}">([^<]*)</script>`))[1];
const meta = JSON.parse(text("motion-meta")), bytes = new Uint8Array(Buffer.from(text("motion-bytes"), "base64"));
const viewer = fs.readFileSync(path.join(__dirname, "../../limber/detail/report/viewer.js"), "utf8");
const { unpackMotion, deform } = vm.runInThisContext(viewer + "\n({ unpackMotion, deform })");
const file = fs.openSync(out, "w");
for (const body of unpackMotion(meta, bytes).filter((b) => b.frames))
  for (let f = 0; f < meta.frames; ++f) deform(body, f, meta.frames), fs.writeSync(file, body.points);
fs.closeSync(file);
