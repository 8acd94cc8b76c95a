"use strict";
// Charts with zoom and values under the pointer, on canvases. Without a script the still figures stay.
(function () {
  const DASHES = [[], [5, 3], [12, 3]], KINDS = ["stable", "unstable", "unstable, other nodal diameter"];
  const FONT = "12px 'DejaVu Sans', Verdana, sans-serif", INK = "#1b1f24", PALE = "#5b6570", GRID = "#e4e8ec";
  const NEAR = 28;  // pixels from the pointer within which a value is shown

  function digits(value, count) { return Number(Number(value).toPrecision(count)).toString(); }
  function linearTicks(low, high, most) {
    const raw = (high - low) / most, power = Math.pow(10, Math.floor(Math.log10(raw)));
    const step = power * [1, 2, 5, 10].find((factor) => factor * power >= raw), found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) { found.push(Number((k * step).toPrecision(12))); }
    return found;
  }
  function logTicks(low, high) {
    const found = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power++) {
      [1, 2, 5].forEach((factor) => found.push(factor * Math.pow(10, power)));
    }
    const within = found.filter((value) => value >= low * 0.9999 && value <= high * 1.0001);
    return within.length >= 2 ? within : linearTicks(low, high, 6);
  }

  function chart(box, data) {
    const canvas = box.querySelector("canvas"), pen = canvas.getContext("2d"), tip = box.querySelector(".tip");
    const part = box.querySelector(".part"), logarithmic = box.querySelector(".log"), legend = box.querySelector(".legend-of");
    if (!pen) { return; }
    const off = new Set();
    let view = null, held = null, moving = null, lifted = null, waiting = false;
    const inside = () => ({ x: 62, y: 12, w: Math.max(canvas.clientWidth - 76, 50), h: Math.max(canvas.clientHeight - 60, 50) });
    const isLog = () => logarithmic.checked;
    const parts = () => (part && part.value !== "" ? Number(part.value) : null);
    const visible = (one) => !off.has(one.name) && (parts() === null || one.part === undefined || one.part === null || one.part === parts());
    const shown = () => data.lines.filter(visible);
    const marks = () => (data.marks || []).filter(visible);

    function extent() {
      let x0 = Infinity, x1 = -Infinity, y0 = Infinity, y1 = -Infinity;
      const all = shown().concat(marks());
      (all.length ? all : data.lines).forEach((line) => {
        for (let k = 0; k < line.x.length; k++) {
          const x = line.x[k], y = line.y[k];
          if (x === null || y === null || (isLog() && y <= 0)) { continue; }
          x0 = Math.min(x0, x); x1 = Math.max(x1, x); y0 = Math.min(y0, y); y1 = Math.max(y1, y);
        }
      });
      if (!(x0 < Infinity)) { x0 = 0; x1 = 1; y0 = 0.1; y1 = 1; }
      if (x0 === x1) { x0 -= 1; x1 += 1; }
      const margin = data.dots ? 0.03 * (x1 - x0) : 0;
      if (data.names) { x0 -= 0.3; x1 += 0.3; }
      if (isLog()) { return { x0: x0 - margin, x1: x1 + margin, y0: Math.max(y0 / 1.2, y1 * 1e-4), y1: y1 * 1.3 }; }
      return { x0: x0 - margin, x1: x1 + margin, y0: Math.min(0, y0), y1: y1 * 1.06 || 1 };
    }
    const place = (v, p) => {
      const level = isLog() ? Math.log : (value) => value, low = level(v.y0), high = level(v.y1);
      return {
        x: (x) => p.x + (x - v.x0) / (v.x1 - v.x0) * p.w, y: (y) => p.y + p.h - (level(y) - low) / (high - low) * p.h,
        backX: (x) => v.x0 + (x - p.x) / p.w * (v.x1 - v.x0),
        backY: (y) => { const at = low + (p.y + p.h - y) / p.h * (high - low); return isLog() ? Math.exp(at) : at; },
      };
    };
    const drawable = (y) => y !== null && (!isLog() || y > 0);

    function axes(v, p, at) {
      pen.font = FONT; pen.lineWidth = 1;
      pen.textAlign = "center"; pen.textBaseline = "top";
      const most = Math.max(Math.floor(p.w / (data.names ? 50 : 90)), 2);
      const ticks = linearTicks(v.x0, v.x1, most).filter((value) => !data.names || Number.isInteger(value));
      ticks.forEach((value) => {
        const x = Math.round(at.x(value)) + 0.5;
        pen.strokeStyle = GRID; pen.beginPath(); pen.moveTo(x, p.y); pen.lineTo(x, p.y + p.h); pen.stroke();
        pen.fillStyle = INK; pen.fillText(data.names ? data.names[value] || "" : digits(value, 7), x, p.y + p.h + 6);
      });
      pen.textAlign = "right"; pen.textBaseline = "middle";
      (isLog() ? logTicks(v.y0, v.y1) : linearTicks(v.y0, v.y1, 6)).forEach((value) => {
        const y = Math.round(at.y(value)) + 0.5;
        pen.strokeStyle = GRID; pen.beginPath(); pen.moveTo(p.x, y); pen.lineTo(p.x + p.w, y); pen.stroke();
        pen.fillStyle = INK; pen.fillText(digits(value, 4), p.x - 6, y);
      });
      pen.strokeStyle = INK; pen.beginPath(); pen.moveTo(p.x + 0.5, p.y); pen.lineTo(p.x + 0.5, p.y + p.h + 0.5); pen.lineTo(p.x + p.w, p.y + p.h + 0.5); pen.stroke();
      pen.fillStyle = PALE; pen.textAlign = "center"; pen.textBaseline = "bottom";
      pen.fillText((data.xlabels && data.xlabels[parts() || 0]) || data.xlabel, p.x + p.w / 2, p.y + p.h + 44);
      pen.save(); pen.translate(12, p.y + p.h / 2); pen.rotate(-Math.PI / 2); pen.textBaseline = "middle"; pen.fillText(data.ylabel, 0, 0); pen.restore();
    }
    function path(line, at) {
      const kinds = line.width === 0 ? [] : line.kinds || [[0, line.x.length, 0]];
      pen.strokeStyle = line.colour;
      pen.lineWidth = (line.width || 1.6) * (lifted === line.name ? 1.9 : 1);
      pen.globalAlpha = (lifted && lifted !== line.name ? 0.25 : 1) * (line.alpha || 1);
      kinds.forEach(([first, last, kind]) => {
        pen.setLineDash(line.dash || DASHES[kind]);
        pen.beginPath();
        let begun = false;
        for (let k = first; k < last; k++) {
          if (!drawable(line.y[k]) || line.x[k] === null) { begun = false; continue; }
          const x = at.x(line.x[k]), y = at.y(line.y[k]);
          if (begun) { pen.lineTo(x, y); } else { pen.moveTo(x, y); begun = true; }
        }
        pen.stroke();
      });
      pen.setLineDash([]);
      if (data.dots || line.dots) {
        const size = line.x.length > 1000 ? 1.6 : line.x.length > 100 ? 2.4 : 4;
        for (let k = 0; k < line.x.length; k++) {
          if (!drawable(line.y[k])) { continue; }
          pen.fillStyle = line.colours ? line.colours[k] : line.colour;
          pen.beginPath(); pen.arc(at.x(line.x[k]), at.y(line.y[k]), size, 0, 2 * Math.PI); pen.fill();
        }
      }
      pen.globalAlpha = 1;
    }
    function symbol(shape, x, y) {
      pen.beginPath();
      if (shape === "star") {
        for (let k = 0; k < 10; k++) {
          const radius = k % 2 ? 3 : 7.5, angle = Math.PI * (k / 5 - 0.5);
          pen.lineTo(x + radius * Math.cos(angle), y + radius * Math.sin(angle));
        }
        pen.closePath();
      } else if (shape === "square") { pen.rect(x - 3.5, y - 3.5, 7, 7);
      } else if (shape === "diamond") { pen.moveTo(x, y - 5); pen.lineTo(x + 4, y); pen.lineTo(x, y + 5); pen.lineTo(x - 4, y); pen.closePath();
      } else if (shape === "triangle") { pen.moveTo(x, y - 5); pen.lineTo(x + 5, y + 4); pen.lineTo(x - 5, y + 4); pen.closePath();
      } else if (shape === "cross") { pen.moveTo(x - 4, y - 4); pen.lineTo(x + 4, y + 4); pen.moveTo(x - 4, y + 4); pen.lineTo(x + 4, y - 4);
      } else if (shape === "arrowhead") { pen.moveTo(x, y); pen.lineTo(x + 4, y + 6); pen.lineTo(x - 4, y + 6); pen.closePath();
      } else { pen.arc(x, y, 4, 0, 2 * Math.PI); }
      pen.stroke();
    }
    function mark(one, at) {
      pen.strokeStyle = one.colour; pen.lineWidth = 1.4;
      pen.globalAlpha = lifted && lifted !== one.name ? 0.25 : 1;
      for (let k = 0; k < one.x.length; k++) { if (drawable(one.y[k])) { symbol(one.shape, at.x(one.x[k]), at.y(one.y[k])); } }
      pen.globalAlpha = 1;
    }
    function nearest(v, p) {
      if (!moving || held) { return null; }
      const at = place(v, p);
      let best = null, least = NEAR * NEAR;
      const offer = (one, k, x, y, t, better) => {
        const dx = x - moving.x, dy = y - moving.y, far = (dx * dx + dy * dy) * better;
        if (far < least) { least = far; best = { one: one, k: k, t: t, x: x, y: y }; }
      };
      const look = (one, better, joined) => {
        let last = null;
        for (let k = 0; k < one.x.length; k++) {
          if (!drawable(one.y[k])) { last = null; continue; }
          const x = at.x(one.x[k]), y = at.y(one.y[k]);
          offer(one, k, x, y, 0, better);
          if (joined && last) {  // between two points: the foot of the perpendicular
            const dx = x - last[0], dy = y - last[1], t = ((moving.x - last[0]) * dx + (moving.y - last[1]) * dy) / (dx * dx + dy * dy || 1);
            if (t > 0 && t < 1) { offer(one, k - 1, last[0] + t * dx, last[1] + t * dy, t, better); }
          }
          last = [x, y];
        }
      };
      shown().forEach((line) => look(line, 1, !data.dots));
      marks().forEach((one) => look(one, 0.6, false));
      return best;
    }
    function say(found, p) {
      tip.hidden = !found;
      if (!found) { return; }
      const one = found.one, lines = [one.said ? one.said[found.k] : one.name];
      if (one.what) { lines.push(one.what); }
      const at = place(view || extent(), p), height = digits(found.t ? at.backY(found.y) : one.y[found.k], 4) + " " + data.yunit;
      lines.push(one.said ? height : digits(found.t ? at.backX(found.x) : one.x[found.k], 6) + " " + data.xunit + ", " + height);
      if (one.kinds) { lines.push(KINDS[one.kinds.find(([first, last]) => found.k >= first && found.k < last)[2]]); }
      tip.textContent = lines.join("\n");
      const left = found.x + 14 + tip.offsetWidth > canvas.clientWidth ? found.x - 14 - tip.offsetWidth : found.x + 14;
      tip.style.left = Math.max(left, 0) + "px";
      tip.style.top = Math.max(Math.min(found.y - tip.offsetHeight / 2, p.y + p.h - tip.offsetHeight), 0) + "px";
      pen.strokeStyle = INK; pen.lineWidth = 1.2; pen.beginPath(); pen.arc(found.x, found.y, 6.5, 0, 2 * Math.PI); pen.stroke();
    }
    function draw() {
      waiting = false;
      const ratio = Math.min(window.devicePixelRatio || 1, 2), width = canvas.clientWidth, height = canvas.clientHeight;
      if (!width) { return; }
      canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      const v = view || extent(), p = inside(), at = place(v, p);
      axes(v, p, at);
      pen.save(); pen.beginPath(); pen.rect(p.x, p.y, p.w, p.h); pen.clip();
      shown().forEach((line) => path(line, at));
      marks().forEach((one) => mark(one, at));
      if (held && held.to) {
        pen.fillStyle = "rgba(0,114,178,0.12)"; pen.strokeStyle = "#0072B2"; pen.lineWidth = 1;
        pen.beginPath(); pen.rect(held.x, held.y, held.to.x - held.x, held.to.y - held.y); pen.fill(); pen.stroke();
      }
      pen.restore();
      say(nearest(v, p), p);
    }
    function soon() { if (!waiting) { waiting = true; requestAnimationFrame(draw); } }
    function zoom(factor, x, y) {
      const v = view || extent(), p = inside(), at = place(v, p), px = x === undefined ? p.x + p.w / 2 : x, py = y === undefined ? p.y + p.h / 2 : y;
      const side = (edge, middle) => middle + (edge - middle) / factor;
      view = { x0: at.backX(side(p.x, px)), x1: at.backX(side(p.x + p.w, px)), y0: at.backY(side(p.y + p.h, py)), y1: at.backY(side(p.y, py)) };
      soon();
    }
    const where = (event) => { const box = canvas.getBoundingClientRect(); return { x: event.clientX - box.left, y: event.clientY - box.top }; };
    canvas.addEventListener("pointerdown", (event) => {
      if (event.pointerType !== "touch") { held = where(event); canvas.setPointerCapture(event.pointerId); }
      moving = where(event); soon();
    });
    canvas.addEventListener("pointermove", (event) => { moving = where(event); if (held) { held.to = moving; } soon(); });
    canvas.addEventListener("pointerup", () => {
      const to = held && held.to, from = held;
      held = null;
      if (to && Math.abs(to.x - from.x) > 6 && Math.abs(to.y - from.y) > 6) {
        const at = place(view || extent(), inside());
        view = { x0: at.backX(Math.min(from.x, to.x)), x1: at.backX(Math.max(from.x, to.x)), y0: at.backY(Math.max(from.y, to.y)), y1: at.backY(Math.min(from.y, to.y)) };
      }
      soon();
    });
    canvas.addEventListener("pointerleave", () => { moving = null; soon(); });
    canvas.addEventListener("pointercancel", () => { moving = held = null; soon(); });
    canvas.addEventListener("dblclick", () => { view = null; soon(); });
    canvas.addEventListener("wheel", (event) => {
      if (document.activeElement === canvas) { event.preventDefault(); const at = where(event); zoom(Math.exp(-event.deltaY * 0.0015), at.x, at.y); }
    }, { passive: false });
    const KEYS = { "+": () => zoom(1.3), "-": () => zoom(1 / 1.3), "0": () => { view = null; soon(); } };
    canvas.addEventListener("keydown", (event) => { if (KEYS[event.key]) { event.preventDefault(); KEYS[event.key](); } });
    box.querySelector(".whole").addEventListener("click", () => { view = null; soon(); });
    box.querySelector(".closer").addEventListener("click", () => zoom(1.4));
    box.querySelector(".farther").addEventListener("click", () => zoom(1 / 1.4));
    logarithmic.checked = data.log;
    logarithmic.addEventListener("change", () => { view = null; soon(); });
    if (part) { part.addEventListener("change", () => { view = null; soon(); }); }

    const named = new Set();
    data.lines.concat(data.marks || []).forEach((one) => {
      if (named.has(one.name) || one.unnamed) { return; }
      named.add(one.name);
      const entry = document.createElement("button"), swatch = document.createElement("span");
      entry.type = "button"; entry.setAttribute("aria-pressed", "true");
      const bar = one.colours || [], part = 100 / bar.length;  // points in colours of their own: all of them
      const stops = bar.map((colour, k) => `${colour} ${k * part}% ${(k + 1) * part}%`);
      swatch.style.background = bar.length ? `linear-gradient(90deg, ${stops.join(", ")})` : one.colour;
      entry.append(swatch, one.name);
      entry.addEventListener("click", () => {
        if (off.has(one.name)) { off.delete(one.name); } else { off.add(one.name); }
        entry.setAttribute("aria-pressed", String(!off.has(one.name)));
        soon();
      });
      entry.addEventListener("pointerenter", () => { lifted = one.name; soon(); });
      entry.addEventListener("pointerleave", () => { lifted = null; soon(); });
      legend.append(entry);
    });
    window.addEventListener("resize", soon);
    const still = document.getElementById(box.id + "-still");
    box.hidden = false;
    if (still && data.replaces) { still.classList.add("printed-only"); }
    draw();
  }
  const all = JSON.parse(document.getElementById("chart-data").textContent);
  Object.keys(all).forEach((name) => {
    const box = document.getElementById("chart-" + name);
    if (box) { chart(box, all[name]); }
  });
})();
