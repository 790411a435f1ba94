// The page's controls: play, scrub, plots that follow, and that can be clicked.
"use strict";
(() => {
  const by = (id) => document.getElementById(id);
  const meta = JSON.parse(by("motion-meta").textContent);
  const bytes = Uint8Array.from(atob(by("motion-bytes").textContent), (c) => c.charCodeAt(0));
  let viewer;
  try {
    viewer = makeViewer(by("view"), meta, unpackMotion(meta, bytes));
  } catch (error) {
    by("stage").classList.add("none");
    by("no-view").textContent = `No picture: ${error.message}. The figures below need none.`;
    viewer = { paint() {}, show() {}, set() {}, view: () => null };
  }

  const plots = [...document.querySelectorAll("svg[data-left]")].map((svg) => {
    const { left, right, low, high, axis } = svg.dataset, n = (v) => Number(v);
    const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
    line.setAttribute("class", "now");
    line.setAttribute("y1", 0), line.setAttribute("y2", svg.viewBox.baseVal.height - 92);
    svg.append(line);
    const x = (s) => n(left) + ((s - low) / (high - low)) * (right - left);
    return { svg, timed: svg.closest("[data-time]") !== null, line, x,
      time: (px) => n(low) + ((px - left) / (right - left)) * (high - low) };
  }).filter((plot) => plot.timed || (plot.line.remove(), false));

  const last = (meta.frames - 1) / meta.frames_per_second;
  let time = 0, playing = false, before = 0;
  const scrub = by("scrub"), play = by("play");
  scrub.max = meta.frames - 1;
  function go(to) {
    time = Math.max(0, Math.min(last, to));
    const frame = time * meta.frames_per_second;
    viewer.show(frame);
    scrub.value = frame;
    by("time").textContent = `${time.toFixed(2)} s of ${last.toFixed(2)} s`;
    for (const { line, x } of plots) line.setAttribute("x1", x(time)), line.setAttribute("x2", x(time));
  }
  function run(yes) {
    if (yes && time >= last) go(0);
    playing = yes;
    play.textContent = yes ? "Pause" : "Play";
    play.setAttribute("aria-pressed", yes);
  }
  play.addEventListener("click", () => run(!playing));
  scrub.addEventListener("input", () => (run(false), go(scrub.value / meta.frames_per_second)));
  for (const box of document.querySelectorAll("input[data-show]"))
    box.addEventListener("change", () => viewer.set(box.dataset.show, box.checked));
  for (const { svg, time: timeAt } of plots) {
    const seek = (e) => {
      if (e.type === "pointermove" && !e.buttons) return;
      const place = new DOMPoint(e.clientX, e.clientY).matrixTransform(svg.getScreenCTM().inverse());
      run(false), go(timeAt(place.x));
    };
    svg.addEventListener("pointerdown", seek), svg.addEventListener("pointermove", seek);
  }
  document.addEventListener("keydown", (e) => {
    if (e.target.closest("video, summary") || e.ctrlKey || e.metaKey || e.altKey) return;
    const step = { ArrowLeft: -1, ArrowRight: 1 }[e.key];
    if (e.key === " " && e.target !== play) e.preventDefault(), run(!playing);
    else if (step && e.target !== scrub) e.preventDefault(), run(false), go(time + step / meta.frames_per_second);
  });
  function tick(now) {
    const speed = Number(by("speed").value);
    if (playing) {
      const to = time + (speed * Math.min(now - before, 250)) / 1000;
      go(to);
      if (to >= last) run(false);
    }
    before = now;
    viewer.paint();
    requestAnimationFrame(tick);
  }
  go(0);
  requestAnimationFrame(tick);
  window.limberReport = { time: () => time, playing: () => playing, view: () => viewer.view() };
})();
