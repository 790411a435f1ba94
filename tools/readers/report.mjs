// node report.mjs NODE_MODULES CHROMIUM FILE.html PICTURES: uses a page of limber report as a reader does, in headless Chromium,
// from file://, without a network. Prints what holds; exit code 1 when something does not. PICTURES: a folder for screenshots.
import { createRequire } from "module";
import path from "path";
import { pathToFileURL } from "url";
const [modules, executablePath, file, pictures] = process.argv.slice(2);
const { chromium } = createRequire(import.meta.url)(modules + "/playwright-core");

let failures = 0;
const check = (holds, what) => (console.log((holds ? "holds    " : "FAILS    ") + what), (failures += !holds));
const browser = await chromium.launch({ executablePath, args: ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic",
  "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync", "--use-gl=angle",
  "--use-angle=swiftshader", "--enable-unsafe-swiftshader"] });
try {
  const page = await browser.newPage({ viewport: { width: 1200, height: 900 }, colorScheme: "light" });
  const complaints = [], requests = [];
  // Taking a screenshot of WebGL makes the driver say that reading pixels takes time.
  page.on("console", (m) => ["error", "warning"].includes(m.type()) && !m.text().includes("stall due to ReadPixels") &&
    complaints.push(m.text()));
  page.on("pageerror", (e) => complaints.push(e.message));
  page.on("request", (r) => /^(data|blob):/.test(r.url()) || requests.push(r.url()));
  await page.goto(pathToFileURL(path.resolve(file)).href);
  await page.waitForFunction(() => window.limberReport);
  const view = page.locator("#view"), state = () => page.evaluate(() => ({ ...limberReport.view(), time: limberReport.time() }));
  const look = async (name) => {
    await page.evaluate(() => new Promise((r) => requestAnimationFrame(() => requestAnimationFrame(r))));
    return view.screenshot(name ? { path: path.join(pictures, name) } : {});
  };
  const same = (a, b) => Buffer.compare(a, b) === 0;
  check((await page.locator("#no-view").textContent()) === "", "WebGL shows the motion");
  const first = await look("first.png");
  // The figures are in the page: as many rows as promises, none empty.
  const rows = await page.locator("#promises tr").count();
  check(rows > 8 && (await page.locator("#promises td:empty").count()) === 0, `${rows - 1} promises in the table`);
  check((await page.locator("svg").count()) >= 7, "plots and the tree are there");

  await page.locator("#speed").selectOption("0.25");  // software draws slowly
  await page.locator("#play").click();
  const went = await (await page.waitForFunction(() => limberReport.time() > 0 && limberReport.time())).jsonValue();
  check(went > 0, `play plays: ${went.toFixed(2)} s later`);
  await page.locator("body").press("Space");
  check(!(await page.evaluate(() => limberReport.playing())), "the space bar stops it");
  const slide = (share) => page.locator("#scrub").evaluate((s, to) => ((s.value = to * s.max), s.dispatchEvent(new Event("input"))), share);
  await slide(0.3);
  const played = await state(), after = await look("played.png");
  check(!same(first, after), `the slider goes to ${played.time.toFixed(2)} s`);
  check((await page.locator("svg line.now").first().getAttribute("x1")) !== null, "plots follow");

  const box = await view.boundingBox(), x = box.x + box.width / 2, y = box.y + box.height / 2;
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 180, y - 40, { steps: 6 });
  await page.mouse.up();
  const turned = await state();
  check(Math.abs(turned.turn - played.turn) > 0.5 && !same(after, await look("turned.png")), "a drag turns the view");
  await page.mouse.wheel(0, -600);
  await page.waitForFunction((d) => limberReport.view().distance < 0.8 * d, turned.distance);
  await look("near.png");
  check(true, "the wheel zooms");
  await view.dblclick();
  const back = await state();
  check(Math.abs(back.turn - played.turn) < 1e-9 && back.distance === played.distance, "a double click brings the first view back");

  await slide(1);
  const end = await state(), last = await look("last.png");
  check(end.time > played.time && !same(last, after), `and to ${end.time.toFixed(2)} s, the end`);
  const plot = page.locator("[data-time] svg").first();
  await plot.scrollIntoViewIfNeeded();
  const area = await plot.boundingBox();
  await page.mouse.click(area.x + area.width / 2, area.y + area.height / 2);
  const middle = await state();
  check(middle.time > 0.2 * end.time && middle.time < 0.8 * end.time, `a click in a plot goes to ${middle.time.toFixed(2)} s`);
  await page.locator("[data-show=cage]").check();
  check(!same(last, await look("cages.png")), "cages can be shown");
  await page.locator("[data-show=cage]").uncheck();
  await page.screenshot({ path: path.join(pictures, "light.png"), fullPage: true });

  await page.emulateMedia({ colorScheme: "dark" });
  await look("dark-view.png");
  await page.screenshot({ path: path.join(pictures, "dark.png"), fullPage: true });
  await page.setViewportSize({ width: 390, height: 800 });
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  check(wide <= 0, "on a telephone nothing sticks out");
  await page.screenshot({ path: path.join(pictures, "narrow.png") });
  check(complaints.length === 0, `nothing on the console${complaints.map((c) => "\n           " + c).join("")}`);
  check(requests.length === 1 && requests[0].startsWith("file://"), `nothing is fetched but the page itself: ${requests.length} request`);
} finally {
  await browser.close();
}
process.exit(failures ? 1 : 0);
