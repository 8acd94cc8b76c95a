"use strict";
// Turns the blade round and lets it vibrate. Without WebGL 2 nothing is shown and the still picture stays.
(function () {
  const get = (name) => document.getElementById("viewer-" + name);
  const canvas = get("canvas");
  let gl = null;
  try { gl = canvas.getContext("webgl2", { antialias: true }); } catch (error) { gl = null; }
  if (!gl) { return; }

  const VERTEX = `#version 300 es
    uniform mat4 view; uniform mat4 projection; uniform float pointSize; uniform float nearer;
    in vec3 position; in float value;
    out vec3 seen; out float size;
    void main() {
      vec4 at = view * vec4(position, 1.0);
      seen = at.xyz; size = value;
      gl_Position = projection * at; gl_Position.z -= nearer * gl_Position.w; gl_PointSize = pointSize;
    }`;
  const FRAGMENT = `#version 300 es
    precision highp float;
    uniform vec4 flatColour; uniform float pale; uniform float round;
    in vec3 seen; in float size;
    out vec4 colour;
    vec3 viridis(float t) {  // polynomial of sixth degree through the colour map
      const vec3 a = vec3(0.2777273272, 0.0054073445, 0.3340998053), b = vec3(0.1050930431, 1.4046135299, 1.3845901626);
      const vec3 c = vec3(-0.3308618287, 0.2148475595, 0.0950951630), d = vec3(-4.6342304990, -5.7991009734, -19.3324409563);
      const vec3 e = vec3(6.2282699363, 14.1799333668, 56.6905526007), f = vec3(4.7763849976, -13.7451453777, -65.3530326334);
      const vec3 g = vec3(-5.4354558559, 4.6458526122, 26.3124352496);
      return a + t * (b + t * (c + t * (d + t * (e + t * (f + t * g)))));
    }
    void main() {
      if (round > 0.5 && length(gl_PointCoord - 0.5) > 0.5) { discard; }
      if (flatColour.a > 0.0) { colour = flatColour; return; }
      vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
      float light = 0.58 + 0.42 * abs(dot(normal, normalize(vec3(0.25, 0.35, 1.0))));
      colour = vec4(mix(viridis(clamp(size, 0.0, 1.0)) * light, vec3(0.93), pale), 1.0);
    }`;

  function compiled(kind, text) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    return gl.getShaderParameter(shader, gl.COMPILE_STATUS) ? shader : null;
  }
  const program = gl.createProgram();
  const parts = [compiled(gl.VERTEX_SHADER, VERTEX), compiled(gl.FRAGMENT_SHADER, FRAGMENT)];
  if (!parts[0] || !parts[1]) { return; }
  parts.forEach((part) => gl.attachShader(program, part));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) { return; }
  gl.useProgram(program);
  const uniform = {}, INDICES = ["triangles", "edges", "sharp", "right", "left"];
  ["view", "projection", "pointSize", "flatColour", "pale", "round", "nearer"].forEach((name) => {
    uniform[name] = gl.getUniformLocation(program, name);
  });

  function decoded(text, Kind) {
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let k = 0; k < raw.length; k++) { bytes[k] = raw.charCodeAt(k); }
    return new Kind(bytes.buffer);
  }
  function indexBuffer(text) {
    const indices = decoded(text, Uint16Array), buffer = gl.createBuffer();
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    return { buffer: buffer, count: indices.length };
  }
  const data = { deformation: 0, surfaces: [], shapes: [] };
  function take(given) {  // surfaces, where there are others than before, and the shapes to choose from
    data.deformation = given.deformation;
    if (given.surfaces) {
      data.surfaces.forEach((surface) => INDICES.forEach((name) => gl.deleteBuffer(surface[name].buffer)));
      data.surfaces = given.surfaces.map((surface) => {
        const rows = { right: decoded(surface.right, Uint16Array), left: decoded(surface.left, Uint16Array) };
        const made = Object.assign({}, surface, { rows: rows, points: decoded(surface.points, Float32Array) });
        INDICES.forEach((name) => { made[name] = indexBuffer(surface[name]); });
        return made;
      });
    }
    data.shapes = given.shapes.map((shape) => Object.assign({}, shape, { harmonics: shape.harmonics.map((row) =>
      Object.assign({}, row, { re: decoded(row.re, Int16Array), im: decoded(row.im, Int16Array) })) }));
    document.getElementById("viewer").hidden = false;
    if (get("still")) { get("still").hidden = true; }
    chosen();
  }
  const positions = gl.createBuffer(), values = gl.createBuffer();
  [[positions, "position", 3], [values, "value", 1]].forEach(([buffer, name, count]) => {
    const place = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, count, gl.FLOAT, false, 0, 0);
  });

  // Where the eye stands: angles about the radius and above the horizon, and how near.
  const SIDE = { yaw: -2.59, pitch: 0.75, near: 1.0 }, TIP = { yaw: -1.5708, pitch: 1.5708, near: 1.15 };
  const eye = Object.assign({}, SIDE);
  let angle = 0.0, playing = false, last = 0.0, waiting = false;
  const shape = () => data.shapes[Number(get("shape").value) || 0];
  const surfaceOf = (one) => data.surfaces[one.surface];
  function blades() {
    const count = Number(get("blades").value), first = -Math.floor((count - 1) / 2);
    return Array.from({ length: count }, (_, k) => first + k);
  }

  // Displacement of blade j at the angle theta: Re sum of u_h exp(i h (theta + j psi)); then the blade turned by j pitches.
  function moved(one, surface, blade, theta, scale) {
    const n = surface.points.length, motion = new Float32Array(n);
    one.harmonics.forEach((row) => {
      if (row.order === 0 && !get("static").checked) { return; }
      const turn = row.order * (theta + blade * one.phase), c = Math.cos(turn) * row.step, s = Math.sin(turn) * row.step;
      for (let k = 0; k < n; k++) { motion[k] += c * row.re[k] - s * row.im[k]; }
    });
    const at = new Float32Array(n), size = new Float32Array(n / 3);
    const cosine = Math.cos(blade * surface.pitch), sine = Math.sin(blade * surface.pitch);
    for (let k = 0; k < n; k += 3) {
      const x = surface.points[k] + scale * motion[k];
      const y = surface.points[k + 1] + scale * motion[k + 1], z = surface.points[k + 2] + scale * motion[k + 2];
      at[k] = x; at[k + 1] = y * cosine + z * sine; at[k + 2] = z * cosine - y * sine;
      size[k / 3] = Math.hypot(motion[k], motion[k + 1], motion[k + 2]) / (one.largest || 1.0);
    }
    return { at: at, size: size };
  }
  function fill(buffer, array) {
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, array, gl.DYNAMIC_DRAW);
  }
  function drawn(kind, indices, colour, pale) {
    gl.uniform4fv(uniform.flatColour, colour || [0, 0, 0, 0]);
    gl.uniform1f(uniform.pale, pale || 0.0);
    gl.uniform1f(uniform.nearer, kind === gl.TRIANGLES ? 0.0 : 0.0012);  // lines and points lie on the faces
    gl.uniform1f(uniform.round, kind === gl.POINTS ? 1.0 : 0.0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, indices.buffer);
    gl.drawElements(kind, indices.count, gl.UNSIGNED_SHORT, 0);
  }

  function aim(surface) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let k = 0; k < surface.points.length; k++) {
      low[k % 3] = Math.min(low[k % 3], surface.points[k]);
      high[k % 3] = Math.max(high[k % 3], surface.points[k]);
    }
    const tip = Math.min(Math.max((eye.pitch - 1.0) / 0.5, 0.0), 1.0);  // from above, the shrouds are what is looked at
    const middle = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2 * (1 - tip) + high[2] * tip];
    const distance = 4.6 * surface.height / eye.near;
    const cp = Math.cos(eye.pitch), sp = Math.sin(eye.pitch), cy = Math.cos(eye.yaw), sy = Math.sin(eye.yaw);
    const back = [cp * cy, cp * sy, sp], right = [-sy, cy, 0], up = [-sp * cy, -sp * sy, cp];
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    gl.uniformMatrix4fv(uniform.view, false, [
      right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
      -dot(right, middle), -dot(up, middle), -dot(back, middle) - distance, 1]);
    const narrow = Math.min(canvas.width / canvas.height / 1.1, 1.0), focal = 6.6 * narrow;
    const n = Math.max(distance - 2.5 * surface.height, 0.1 * distance), f = distance + 2.5 * surface.height;
    gl.uniformMatrix4fv(uniform.projection, false, [
      focal * canvas.height / canvas.width, 0, 0, 0, 0, focal, 0, 0, 0, 0, (f + n) / (n - f), -1, 0, 0, 2 * f * n / (n - f), 0]);
    return { right: right, up: up, back: back, middle: middle, distance: distance, focal: focal, low: low, high: high };
  }

  // Names of the faces, axes and the sense of rotation, over the picture.
  function annotate(surface, frame, at, width, height) {
    const over = get("over"), pen = over.getContext("2d"), ratio = Math.min(window.devicePixelRatio || 1, 2);
    over.width = Math.round(width * ratio); over.height = Math.round(height * ratio);
    over.style.width = width + "px"; over.style.height = height + "px";
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.font = "13px 'DejaVu Sans', Verdana, sans-serif";
    pen.lineWidth = 1.6;
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const project = (point) => {
      const d = point.map((value, k) => value - frame.middle[k]), far = frame.distance - dot(frame.back, d);
      const scale = frame.focal * height / 2 / far;
      return [width / 2 + scale * dot(frame.right, d), height / 2 - scale * dot(frame.up, d)];
    };
    const line = (from, to, colour) => { pen.strokeStyle = colour; pen.beginPath(); pen.moveTo(...from); pen.lineTo(...to); pen.stroke(); };
    const head = (from, to, colour) => {
      const angle = Math.atan2(to[1] - from[1], to[0] - from[0]);
      pen.fillStyle = colour; pen.beginPath(); pen.moveTo(...to);
      [2.7, -2.7].forEach((turn) => pen.lineTo(to[0] + 9 * Math.cos(angle + turn), to[1] + 9 * Math.sin(angle + turn)));
      pen.fill();
    };
    const write = (text, spot, colour) => {
      const x = Math.min(Math.max(spot[0] - pen.measureText(text).width / 2, 2), width - pen.measureText(text).width - 2);
      pen.lineWidth = 3.5; pen.strokeStyle = "#fff"; pen.strokeText(text, x, spot[1]);
      pen.lineWidth = 1.6; pen.fillStyle = colour; pen.fillText(text, x, spot[1]);
    };
    const out = 0.35 * (frame.high[1] - frame.low[1]);
    [["right", " (+y)", 1, "#B34700"], ["left", " (−y)", -1, "#1f78b4"]].forEach(([side, sign, way, colour]) => {
      const name = side + " face" + (surface.between ? sign : "");
      const rows = surface.rows[side], mean = [0, 1, 2].map((k) => rows.reduce((sum, row) => sum + at[3 * row + k], 0) / rows.length);
      const beside = project([mean[0], mean[1] + way * out, mean[2]]);
      line(project(mean), beside, colour);
      write(name, [beside[0], beside[1] - 4], colour);
    });
    const radius = frame.high[2] + 0.07 * surface.height, spread = 0.12 * surface.height / radius;
    let before = null;
    for (let k = -8; k <= 8; k++) {
      const angle = spread * k / 8, spot = project([frame.high[0] + 0.04 * surface.height, radius * Math.sin(angle), radius * Math.cos(angle)]);
      if (before) { line(before, spot, "#7a1fa2"); }
      if (k === 8) { head(before, spot, "#7a1fa2"); write("rotation", [spot[0], spot[1] - 8], "#7a1fa2"); }
      before = spot;
    }
    const corner = [58, height - 52];
    [["x", [1, 0, 0]], ["y", [0, 1, 0]], ["z", [0, 0, 1]]].forEach(([name, e]) => {
      const x = dot(frame.right, e), y = -dot(frame.up, e), end = [corner[0] + 38 * x, corner[1] + 38 * y];
      line(corner, end, "#1b1f24");
      if (Math.hypot(x, y) > 0.2) { head(corner, end, "#1b1f24"); write(name, [corner[0] + 50 * x, corner[1] + 50 * y + 4], "#1b1f24"); }
    });
  }

  function render() {
    const one = shape();
    if (!one) { return; }
    const surface = surfaceOf(one), ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    if (!width || !height) { return; }
    const scale = one.largest ? data.deformation * surface.height * Number(get("size").value) / 100 / one.largest : 0.0;
    gl.viewport(0, 0, width, height);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniform1f(uniform.pointSize, 7.0 * ratio);
    const frame = aim(surface);
    let own = surface.points;
    blades().forEach((blade) => {
      const found = moved(one, surface, blade, angle, scale);
      if (blade === 0) { own = found.at; }
      fill(positions, found.at);
      fill(values, found.size);
      drawn(gl.TRIANGLES, surface.triangles, null, blade === 0 ? 0.0 : 0.62);
      if (get("mesh").checked && surface.edges.count) { drawn(gl.LINES, surface.edges, blade === 0 ? [0.25, 0.25, 0.25, 1] : [0.72, 0.74, 0.77, 1]); }
      drawn(gl.LINES, surface.sharp, blade === 0 ? [0.05, 0.05, 0.05, 1] : [0.5, 0.55, 0.6, 1]);
      if (blade === 0) {
        drawn(gl.POINTS, surface.right, [0.835, 0.369, 0.0, 1]);
        drawn(gl.POINTS, surface.left, [0.337, 0.706, 0.914, 1]);
      }
    });
    fill(positions, moved(one, surface, 0, 0.0, 0.0).at);
    drawn(gl.LINES, surface.sharp, [0.62, 0.62, 0.62, 1]);
    annotate(surface, frame, own, canvas.clientWidth, canvas.clientHeight);
    tell(one, scale);
    canvas.dispatchEvent(new CustomEvent("turned", { detail: angle }));
  }
  function tell(one, scale) {
    const times = scale ? String(Number(scale.toPrecision(3))) : "0";
    get("largest").textContent = one.shown || "largest";
    get("said").textContent = one.name + (one.shown ? ", drawn " + times + " times as large." : ", drawn up to " + Number((scale * one.largest * 1000).toPrecision(3)) + " mm.");
  }
  function step(now) {
    waiting = false;
    if (playing) {
      angle = (angle + (now - last) / 1000 * Math.PI) % (2 * Math.PI);
      get("phase").value = String(Math.round(angle * 180 / Math.PI));
    }
    last = now;
    render();
    if (playing) { soon(); }
  }
  function soon() { if (!waiting) { waiting = true; requestAnimationFrame(step); } }
  function play(whether) {
    playing = whether;
    last = performance.now();
    get("play").textContent = playing ? "pause" : "play";
    soon();
  }
  function chosen() {
    const one = shape();
    angle = one.angle;
    get("phase").value = String(Math.round(angle * 180 / Math.PI));
    get("mesh").disabled = surfaceOf(one).edges.count === 0;
    get("static").disabled = !one.harmonics.some((row) => row.order === 0);
    soon();
  }
  function turn(yaw, pitch) {
    eye.yaw += yaw;
    eye.pitch = Math.min(Math.max(eye.pitch + pitch, -1.5708), 1.5708);
    soon();
  }
  function zoom(factor) { eye.near = Math.min(Math.max(eye.near * factor, 0.3), 12.0); soon(); }

  get("shape").addEventListener("change", chosen);
  ["blades", "static", "mesh"].forEach((name) => get(name).addEventListener("change", soon));
  get("size").addEventListener("input", soon);
  get("phase").addEventListener("input", () => { angle = Number(get("phase").value) * Math.PI / 180; soon(); });
  get("play").addEventListener("click", () => play(!playing));
  get("side").addEventListener("click", () => { Object.assign(eye, SIDE); soon(); });
  get("tip").addEventListener("click", () => { Object.assign(eye, TIP); soon(); });
  get("closer").addEventListener("click", () => zoom(1.25));
  get("farther").addEventListener("click", () => zoom(0.8));
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointermove", (event) => {
    if (canvas.hasPointerCapture(event.pointerId)) { turn(-event.movementX * 0.008, event.movementY * 0.008); }
  });
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement === canvas) { event.preventDefault(); zoom(Math.exp(-event.deltaY * 0.0012)); }
  }, { passive: false });
  const KEYS = {
    ArrowLeft: () => turn(0.12, 0), ArrowRight: () => turn(-0.12, 0), ArrowUp: () => turn(0, 0.12), ArrowDown: () => turn(0, -0.12),
    "+": () => zoom(1.15), "-": () => zoom(0.87), " ": () => play(!playing),
  };
  canvas.addEventListener("keydown", (event) => {
    if (KEYS[event.key]) { event.preventDefault(); KEYS[event.key](); }
  });
  window.addEventListener("resize", soon);
  canvas.addEventListener("webglcontextlost", () => {
    play(false);
    document.getElementById("viewer").hidden = true;
    if (get("still")) { get("still").hidden = false; }
  });
  canvas.addEventListener("shapes", (event) => take(event.detail));  // of a page that makes them while it is open
  if (get("data")) { take(JSON.parse(get("data").textContent)); }
})();
