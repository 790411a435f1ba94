// Plays a motion in WebGL 2. Every vertex of a fine surface hangs on the four nodes of its tet (or, by Phong Deformation, on those
// and the nodes round them: docs/binding.md); only the nodes move by frames, so a page holds the motion of the cages and each
// surface once. z is up, metres. Light as in limber's films: a key light with a shadow
// over the photographer's left shoulder, sky, and a ground that fades out.
"use strict";

// The motion as limber/detail/report/report_motion.h packs it: `meta` says where in `bytes` what is.
function unpackMotion(meta, bytes) {
  const array = (Type, [offset, count]) => new Type(bytes.buffer, offset, count);
  const spread = (packed, low, step) => Float32Array.from(packed, (n, i) => low[i % 3] + step[i % 3] * n);
  return meta.bodies.map((m) => {
    const rest = spread(array(Uint16Array, m.positions), m.low, m.step);
    const body = { name: m.name, color: m.color, rest, triangles: array(m.wide ? Uint32Array : Uint16Array, m.triangles) };
    if (!m.cage) return body;
    const nodes = array(Float32Array, m.cage), tets = array(Uint32Array, m.tets), of = array(Uint32Array, m.tet_from_vertex);
    const corners = new Uint32Array((rest.length / 3) * 4), weights = new Float32Array(corners.length);
    for (let v = 0; v < of.length; ++v) {
      const c = tets.subarray(4 * of[v], 4 * of[v] + 4);
      corners.set(c, 4 * v);
      weights.set(barycentric(nodes, c, rest.subarray(3 * v, 3 * v + 3)), 4 * v);
    }
    return { ...body, nodes: new Float32Array(nodes.length), frames: array(Uint16Array, m.frames), low: m.frames_low,
      step: m.frames_step, corners, weights, edges: array(Uint32Array, m.edges), points: rest.slice(),
      gradients: m.phong ? nodeGradients(nodes, tets) : null, cage: nodes };
  });
}

// As ffd::node_gradients: of node i the neighbours j and g_ij with F_i = Σ x_j g_ijᵀ.
function nodeGradients(nodes, tets) {
  const count = nodes.length / 3, volume = new Float64Array(count), rows = Array.from({ length: count }, () => new Map());
  const at = (k) => nodes.subarray(3 * k, 3 * k + 3);
  for (let t = 0; t < tets.length; t += 4) {
    const tet = tets.subarray(t, t + 4), [b, c, d] = [1, 2, 3].map((k) => minus(at(tet[k]), at(tet[0])));
    const faces = [cross(c, d), cross(d, b), cross(b, c)], six = dot(b, faces[0]);
    const shares = [minus([0, 0, 0], faces.reduce((sum, face) => plus(sum, face))), ...faces];
    for (const i of tet) {
      volume[i] += six;
      shares.forEach((share, k) => rows[i].set(tet[k], plus(rows[i].get(tet[k]) || [0, 0, 0], share)));
    }
  }
  const begin = Uint32Array.from({ length: count + 1 }), size = rows.reduce((sum, row) => sum + row.size, 0);
  const neighbours = new Uint32Array(size), gradients = new Float64Array(3 * size);
  rows.forEach((row, i) => {
    let k = begin[i];
    for (const [j, sum] of row) neighbours[k] = j, gradients.set(sum.map((s) => s / volume[i]), 3 * k), ++k;
    begin[i + 1] = k;
  });
  return { begin, neighbours, gradients, maps: new Float64Array(12 * count) };
}

// Nodes at a frame, between two of which they move straight, and the surface by them.
function deform(body, frame, frames) {
  const first = Math.min(Math.floor(frame), frames - 1), next = Math.min(first + 1, frames - 1), share = frame - first;
  const { nodes, frames: f, corners: c, weights: w, points: p } = body, n = nodes.length;
  for (let i = 0; i < n; ++i)
    nodes[i] = body.low[i % 3] + body.step[i % 3] * (f[first * n + i] * (1 - share) + f[next * n + i] * share);
  if (body.gradients) return deformPhong(body);
  for (let v = 0, i = 0; i < p.length; v += 4, i += 3)
    for (let k = 0; k < 3; ++k)
      p[i + k] = w[v] * nodes[3 * c[v] + k] + w[v + 1] * nodes[3 * c[v + 1] + k] + w[v + 2] * nodes[3 * c[v + 2] + k] +
        w[v + 3] * nodes[3 * c[v + 3] + k];
}

// As ffd::deform_phong: a map a node, x_i − ½ F_i X_i and ½ F_i, coordinate after coordinate.
function deformPhong({ nodes, cage, corners: c, weights: w, points: p, rest, gradients }) {
  const { begin, neighbours, gradients: g, maps } = gradients;
  for (let i = 0; i < nodes.length / 3; ++i)
    for (let k = 0; k < 3; ++k) {
      let a = 0, b = 0, d = 0;
      for (let e = begin[i]; e < begin[i + 1]; ++e) {
        const x = 0.5 * nodes[3 * neighbours[e] + k];
        a += x * g[3 * e], b += x * g[3 * e + 1], d += x * g[3 * e + 2];
      }
      maps.set([nodes[3 * i + k] - a * cage[3 * i] - b * cage[3 * i + 1] - d * cage[3 * i + 2], a, b, d], 12 * i + 4 * k);
    }
  for (let v = 0, i = 0; i < p.length; v += 4, i += 3)
    for (let k = 0; k < 3; ++k) {
      let sum = 0;
      for (let e = 0; e < 4; ++e) {
        const m = 12 * c[v + e] + 4 * k;
        sum += w[v + e] * (maps[m] + maps[m + 1] * rest[i] + maps[m + 2] * rest[i + 1] + maps[m + 3] * rest[i + 2]);
      }
      p[i + k] = sum;
    }
}

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const plus = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const unit = (a) => plus([0, 0, 0], a, 1 / Math.hypot(...a));

function barycentric(nodes, corners, point) {
  const at = (k) => nodes.subarray(3 * corners[k], 3 * corners[k] + 3);
  const [a, b, c] = [1, 2, 3].map((k) => minus(at(k), at(0))), p = minus(point, at(0));
  const six = dot(a, cross(b, c));
  const w = [dot(p, cross(b, c)) / six, dot(a, cross(p, c)) / six, dot(a, cross(b, p)) / six];
  return [1 - w[0] - w[1] - w[2], ...w];
}

// Matrices: 16 numbers, column after column.
const product = (m, n) => Float32Array.from({ length: 16 }, (_, i) =>
  [0, 1, 2, 3].reduce((sum, k) => sum + m[(i % 4) + 4 * k] * n[k + 4 * (i >> 2)], 0));
function lookAt(eye, target, up = [0, 0, 1]) {
  const back = unit(minus(eye, target)), right = unit(cross(up, back)), top = cross(back, right);
  return [right[0], top[0], back[0], 0, right[1], top[1], back[1], 0, right[2], top[2], back[2], 0,
    -dot(right, eye), -dot(top, eye), -dot(back, eye), 1];
}
function perspective(fov, aspect, near, far) {
  const f = 1 / Math.tan(fov / 2), d = near - far;
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (near + far) / d, -1, 0, 0, (2 * near * far) / d, 0];
}
// A ball, as a light far away in the direction `toward` sees it.
const ballView = (middle, toward, radius) => product([1 / radius, 0, 0, 0, 0, 1 / radius, 0, 0, 0, 0, -1 / radius, 0, 0, 0, 0, 1],
  lookAt(plus(middle, toward), middle).map((x, i) => (i === 14 ? x + 1 : x)));

const SHADE = `#version 300 es
precision highp float;
precision highp sampler2DShadow;
uniform sampler2DShadow shadow_map;
float lit(vec3 place, float spread) {
  float sum = 0.0;
  for (int i = 0; i < 16; ++i) {  // a spiral
    float a = 2.4 * float(i), r = spread * sqrt((float(i) + 0.5) / 16.0);
    sum += texture(shadow_map, vec3(place.xy + r * vec2(cos(a), sin(a)), place.z));
  }
  return sum / 16.0;
}
vec3 shown(vec3 light) { return pow(min(light, 1.0), vec3(1.0 / 2.2)); }
`;
const PROGRAMS = {
  depth: [`#version 300 es
in vec3 position;
uniform mat4 view;
void main() { gl_Position = view * vec4(position, 1.0); }`, `#version 300 es
precision highp float;
void main() {}`],
  mesh: [`#version 300 es
in vec3 position, normal;
uniform mat4 view, shadow_view;
uniform vec3 key;
uniform float offset;  // along the normal: about a texel of the shadow map
centroid out vec3 p, n, s;  // within the triangle also where it covers a pixel in part, or edges get dark specks
void main() {
  p = position;
  n = normal;
  vec3 out_of_it = normalize(normal) * (dot(normal, key) < 0.0 ? -offset : offset);
  s = 0.5 + 0.5 * (shadow_view * vec4(position + out_of_it, 1.0)).xyz;
  gl_Position = view * vec4(position, 1.0);
}`, SHADE + `
centroid in vec3 p, n, s;
uniform vec3 key, eye, color, ground_color;
out vec4 pixel;
void main() {
  vec3 m = normalize(n), v = normalize(eye - p), h = normalize(key + v);
  if (dot(m, v) < 0.0) m = -m;
  float light = max(dot(m, key), 0.0) * lit(s, 0.0015), edge = 1.0 - max(dot(m, v), 0.0);
  vec3 sky = mix(0.55 * ground_color, vec3(0.42, 0.445, 0.48), 0.5 + 0.5 * m.z);
  vec3 sum = color * (light * vec3(0.80, 0.78, 0.75) + sky);
  sum += light * 0.10 * pow(max(dot(m, h), 0.0), 40.0) + 0.10 * edge * edge * edge * (0.5 + 0.5 * m.z);
  pixel = vec4(shown(sum), 1.0);
}`],
  ground: [`#version 300 es
in vec3 position;
uniform mat4 view, shadow_view;
out vec3 p, s;
void main() {
  p = position;
  s = 0.5 + 0.5 * (shadow_view * vec4(position, 1.0)).xyz;
  gl_Position = view * vec4(position, 1.0);
}`, SHADE + `
in vec3 p, s;
uniform vec3 ground_color, middle;
uniform float radius;
out vec4 pixel;
void main() {
  vec3 below = vec3(s.xy, min(s.z, 0.999));  // the ground may lie beyond the map's depth, but no body does
  bool inside = all(lessThan(abs(s.xy - 0.5), vec2(0.49)));
  float light = inside ? 0.5 * lit(below, 0.002) + 0.5 * lit(below, 0.012) : 1.0;
  float there = 1.0 - smoothstep(0.75, 1.7, length(p.xy - middle.xy) / radius);
  pixel = vec4(shown(ground_color * mix(0.45, 1.0, light)), 1.0) * there;
}`],
  lines: [`#version 300 es
in vec3 position;
uniform mat4 view;
void main() { gl_Position = view * vec4(position, 1.0); }`, `#version 300 es
precision highp float;
uniform vec4 color;
out vec4 pixel;
void main() { pixel = vec4(color.rgb * color.a, color.a); }`],
};
const SHADOW_SIZE = 2048;

// `canvas` shows the motion from meta.camera until the reader turns it. Throws where there is no WebGL 2.
function makeViewer(canvas, meta, bodies) {
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
  if (!gl) throw new Error("this browser shows no WebGL 2");
  const programs = Object.fromEntries(Object.entries(PROGRAMS).map(([name, sources]) => [name, linked(sources)]));
  const target = shadowTarget();
  const on = { cage: false, stage: true };

  function linked(sources) {
    const program = gl.createProgram();
    sources.forEach((source, i) => {
      const shader = gl.createShader(i ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    });
    ["position", "normal"].forEach((name, i) => gl.bindAttribLocation(program, i, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS))
      throw new Error([gl.getProgramInfoLog(program), ...gl.getAttachedShaders(program).map((s) => gl.getShaderInfoLog(s))].join(" "));
    return program;
  }
  function shadowTarget() {
    const texture = gl.createTexture(), buffer = gl.createFramebuffer();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, SHADOW_SIZE, SHADOW_SIZE);
    for (const [key, value] of [[gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
      [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
      [gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE], [gl.TEXTURE_COMPARE_FUNC, gl.LEQUAL]])
      gl.texParameteri(gl.TEXTURE_2D, key, value);
    gl.bindFramebuffer(gl.FRAMEBUFFER, buffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, texture, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return { texture, buffer };
  }
  // Attributes of three numbers each; `indices` may be missing.
  function shape(arrays, indices) {
    const vao = gl.createVertexArray();
    gl.bindVertexArray(vao);
    const buffers = arrays.map((data, i) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 0, 0);
      return buffer;
    });
    if (indices) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    }
    gl.bindVertexArray(null);
    return { vao, count: indices ? indices.length : arrays[0].length / 3,
      type: indices && (indices.BYTES_PER_ELEMENT === 2 ? gl.UNSIGNED_SHORT : gl.UNSIGNED_INT),
      fill: (i, data) => (gl.bindBuffer(gl.ARRAY_BUFFER, buffers[i]), gl.bufferSubData(gl.ARRAY_BUFFER, 0, data)) };
  }
  function draw(it, mode) {
    gl.bindVertexArray(it.vao);
    if (it.type) gl.drawElements(mode, it.count, it.type, 0);
    else gl.drawArrays(mode, 0, it.count);
  }
  function use(name, values) {
    const program = programs[name];
    gl.useProgram(program);
    for (const [key, value] of Object.entries(values)) {
      const at = gl.getUniformLocation(program, key);
      if (typeof value === "number") gl.uniform1f(at, value);
      else if (value.length === 16) gl.uniformMatrix4fv(at, false, value);
      else (value.length === 4 ? gl.uniform4fv : gl.uniform3fv).call(gl, at, value);
    }
  }

  const low = meta.stage[0], high = meta.stage[1];
  const middle = low.map((x, k) => (x + high[k]) / 2), radius = Math.hypot(...minus(high, low)) / 2;
  const away = minus(meta.camera.eye, meta.camera.target), level = Math.hypot(away[0], away[1]);
  const left = (-40 * Math.PI) / 180, height = 1.3;
  const key = unit(level < 1e-3 * Math.hypot(...away) ? [-0.5, -0.6, 1] : [
    (away[0] * Math.cos(left) - away[1] * Math.sin(left)) / level,
    (away[0] * Math.sin(left) + away[1] * Math.cos(left)) / level, height]);
  const shadowView = ballView(middle, key, radius);
  const size = 4 * radius, z = meta.ground;
  const ground = shape([new Float32Array([[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]].flatMap(([x, y]) =>
    [middle[0] + size * x, middle[1] + size * y, z]))]);

  for (const body of bodies) {
    body.points = body.points || body.rest;
    body.normals = new Float32Array(body.rest.length);
    turnNormals(body);
    body.mesh = shape([body.points, body.normals], body.triangles);
    if (body.frames) body.lines = shape([body.nodes], body.edges);
  }
  const path = shape([new Float32Array(meta.path.flat())]);
  const bounds = shape([new Float32Array(boxEdges(meta.bounds))]);
  const goal = shape([new Float32Array(goalLines([0, 0, 0]))]);

  function boxEdges([a, b]) {
    const corner = (i) => [i & 1 ? b[0] : a[0], i & 2 ? b[1] : a[1], i & 4 ? b[2] : a[2]];
    return [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) => [1, 2, 4].filter((k) => !(i & k)).flatMap((k) => [...corner(i), ...corner(i | k)]));
  }
  function goalLines(shift) {
    if (!meta.goal) return [];  // a simulation has none
    if (meta.goal.box) return boxEdges(meta.goal.box.map((p) => plus(p, shift)));
    const center = plus(meta.goal.center, shift), lines = [], n = 48;
    for (let axis = 0; axis < 3; ++axis)
      for (let i = 0; i < 2 * n; ++i) {
        const a = (2 * Math.PI * ((i + 1) >> 1)) / n, p = [0, 0, 0];
        p[axis] = Math.cos(a), p[(axis + 1) % 3] = Math.sin(a);
        lines.push(...plus(center, p, meta.goal.radius));
      }
    return lines;
  }

  // Sums of the area vectors round each vertex; shaders make them unit.
  function turnNormals({ points: p, normals: n, triangles: t }) {
    n.fill(0);
    for (let i = 0; i < t.length; i += 3) {
      const a = 3 * t[i], b = 3 * t[i + 1], c = 3 * t[i + 2];
      const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
      const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
      const x = uy * vz - uz * vy, y = uz * vx - ux * vz, w = ux * vy - uy * vx;
      n[a] += x, n[a + 1] += y, n[a + 2] += w;
      n[b] += x, n[b + 1] += y, n[b + 2] += w;
      n[c] += x, n[c + 1] += y, n[c + 2] += w;
    }
  }
  function move(body, frame) {
    deform(body, frame, meta.frames);
    turnNormals(body);
    body.mesh.fill(0, body.points), body.mesh.fill(1, body.normals), body.lines.fill(0, body.nodes);
  }

  const start = () => {
    const d = minus(meta.camera.eye, meta.camera.target), r = Math.hypot(...d);
    return { target: meta.camera.target.slice(), distance: r, turn: Math.atan2(d[1], d[0]), rise: Math.asin(d[2] / r) };
  };
  let view = start(), frame = -1, wanted = 0, dirty = true;
  const eye = () => plus(view.target, [Math.cos(view.rise) * Math.cos(view.turn), Math.cos(view.rise) * Math.sin(view.turn),
    Math.sin(view.rise)], view.distance);

  function paint() {
    if (!dirty) return;
    dirty = false;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const w = Math.max(1, Math.round(canvas.clientWidth * ratio)), h = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== w || canvas.height !== h) canvas.width = w, canvas.height = h;
    if (frame !== wanted) {
      frame = wanted;
      for (const body of bodies) if (body.frames) move(body, frame);
      const near = Math.round(frame);
      if (meta.goal?.shifts) goal.fill(0, new Float32Array(goalLines(meta.goal.shifts[near])));
    }
    gl.enable(gl.DEPTH_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.buffer);
    gl.viewport(0, 0, SHADOW_SIZE, SHADOW_SIZE);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(2, 4);
    use("depth", { view: shadowView });
    for (const body of bodies) draw(body.mesh, gl.TRIANGLES);
    gl.disable(gl.POLYGON_OFFSET_FILL);

    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const at = eye(), reach = Math.hypot(...minus(at, middle)) + 3 * size;
    // Upright pictures keep the width of the scene in view.
    const fov = 2 * Math.atan(Math.tan((meta.camera.fov_deg * Math.PI) / 360) * Math.max(1, (16 / 9) * (h / w)));
    const clip = product(perspective(fov, w / h, Math.max(0.01 * view.distance, reach / 5000), reach),
      lookAt(at, view.target));
    const dark = getComputedStyle(canvas).getPropertyValue("--dark").trim() === "1";
    const groundColor = dark ? [0.030, 0.034, 0.040] : [0.80, 0.82, 0.85];
    const stage = { view: clip, shadow_view: shadowView, ground_color: groundColor };
    gl.bindTexture(gl.TEXTURE_2D, target.texture);
    if (at[2] > z) {
      gl.depthMask(false);
      use("ground", { ...stage, middle, radius });
      draw(ground, gl.TRIANGLES);
      gl.depthMask(true);
    }
    for (const body of bodies) {
      use("mesh", { ...stage, key, eye: at, color: body.color, offset: (3 * radius) / SHADOW_SIZE });
      draw(body.mesh, gl.TRIANGLES);
    }
    const ink = dark ? [0.75, 0.8, 0.87] : [0.3, 0.34, 0.4];
    if (on.stage) {
      use("lines", { view: clip, color: [...ink, 0.35] });
      draw(bounds, gl.LINES);
      use("lines", { view: clip, color: [0.16, 0.62, 0.25, 0.9] });
      draw(goal, gl.LINES);
      use("lines", { view: clip, color: [0.84, 0.18, 0.15, 0.9] });
      draw(path, gl.LINE_STRIP);
    }
    if (on.cage) {
      gl.disable(gl.DEPTH_TEST);
      use("lines", { view: clip, color: [...ink, 0.55] });
      for (const body of bodies) if (body.lines) draw(body.lines, gl.LINES);
    }
  }

  const changed = () => (dirty = true);
  const hands = new Map();
  canvas.addEventListener("pointerdown", (e) => (canvas.setPointerCapture(e.pointerId), hands.set(e.pointerId, e)));
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (e) => hands.delete(e.pointerId));
  canvas.addEventListener("pointermove", (e) => {
    const before = hands.get(e.pointerId);
    if (!before) return;
    const dx = e.clientX - before.clientX, dy = e.clientY - before.clientY;
    if (hands.size === 2) {  // pinch
      const other = [...hands.values()].find((o) => o.pointerId !== e.pointerId);
      const apart = (a) => Math.hypot(a.clientX - other.clientX, a.clientY - other.clientY);
      zoom(apart(before) / Math.max(1, apart(e)));
    } else if (e.shiftKey || e.buttons & 6) {
      const step = (2 * view.distance * Math.tan((meta.camera.fov_deg * Math.PI) / 360)) / canvas.clientHeight;
      const back = unit(minus(eye(), view.target)), right = unit(cross([0, 0, 1], back));
      view.target = plus(plus(view.target, right, -dx * step), cross(back, right), dy * step);
    } else {
      view.turn -= 0.006 * dx;
      view.rise = Math.max(-1.5, Math.min(1.5, view.rise + 0.006 * dy));
    }
    hands.set(e.pointerId, e);
    changed();
  });
  const zoom = (by) => (view.distance = Math.max(0.05 * radius, Math.min(8 * radius, view.distance * by)), changed());
  canvas.addEventListener("wheel", (e) => (e.preventDefault(), zoom(Math.exp(0.001 * e.deltaY * (e.deltaMode ? 30 : 1)))), { passive: false });
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("dblclick", () => ((view = start()), changed()));
  new ResizeObserver(changed).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed);

  return {
    paint,
    show: (f) => ((wanted = Math.max(0, Math.min(meta.frames - 1, f))), changed()),
    set: (what, value) => ((on[what] = value), changed()),
    view: () => ({ ...view }),
  };
}
