"use strict";
// The page's own part: knobs and words. What is turned goes to the program as "asked", what it finds comes as "told".
(function () {
  const get = (id) => document.getElementById(id);
  const page = window.explore = { sent: 0, answered: 0, turned: [], answers: [], latencies: [] };  // read by tests and benchmarks
  let model = null, pending = null, flying = 0, knobs = {}, nodes = null, angle = 0;

  function made(tag, attributes, ...children) {
    const one = document.createElement(tag);
    Object.entries(attributes || {}).forEach(([name, value]) => {
      if (value === false || value === null || value === undefined) { return; }
      if (name.startsWith("on")) { one.addEventListener(name.slice(2), value); } else { one.setAttribute(name, value === true ? "" : value); }
    });
    one.append(...children);
    return one;
  }

  // One turn at a time is on its way; while it is, only the newest one waits.
  function ask(what) {
    if (!model) { return; }
    page.sent += 1;
    page.turned[page.sent % 64] = performance.now();
    model.asked.value = JSON.stringify(Object.assign({ number: page.sent }, what));
  }
  function turn(change) {
    if (!pending) { pending = { change: {}, since: performance.now() }; }
    Object.assign(pending.change, change);
    if (!flying) { send(); }
  }
  function send() {
    if (!pending) { return; }
    const { change, since } = pending;
    pending = null;
    ask({ turn: change });
    page.turned[page.sent % 64] = since;
    flying = page.sent;
    const number = flying;
    setTimeout(() => { if (flying === number) { document.body.classList.add("waiting"); } }, 250);
    setTimeout(() => { if (flying === number) { flying = 0; send(); } }, 1000);  // a newer turn does not wait for it
  }
  function answered(number) {
    page.answered = number;
    if (number >= flying) { flying = 0; document.body.classList.remove("waiting"); send(); }
    const since = page.turned[number % 64];
    page.answers.push(performance.now() - since);
    requestAnimationFrame(() => requestAnimationFrame(() => {  // drawn by then
      page.latencies.push(performance.now() - since);
      [page.answers, page.latencies].forEach((list) => { if (list.length > 4096) { list.shift(); } });
    }));
  }

  function knobRow(knob) {
    const id = "knob-" + knob.key.replaceAll(".", "-"), row = made("div", { class: "knob", "data-key": knob.key });
    row.append(made("label", { for: id, title: knob.key }, knob.label));
    if (knob.choices) {
      const choice = made("select", { id: id, onchange: () => changed(knob, { choice: choice.selectedIndex }) });
      knob.choices.forEach((name) => choice.append(made("option", {}, name)));
      row.append(choice);
    } else {
      const number = made("input", { id: id, type: "number", step: "any", title: knob.range,
        onchange: () => { if (number.value !== "" || number.validity.badInput) { changed(knob, { shown: number.value || "?" }); } },
        onkeydown: (event) => {  // as on the slider, whose steps fit its range
          const way = { ArrowUp: 1, ArrowDown: -1 }[event.key];
          if (way) { event.preventDefault(); changed(knob, { position: Math.min(Math.max(Number(range.value) + way * knob.step, 0), 1) }); }
        } });
      const range = made("input", { class: "range", type: "range", min: 0, max: 1, step: knob.step, "aria-label": knob.label,
        oninput: () => changed(knob, { position: Number(range.value) }) });
      row.append(number, range);
    }
    return row;
  }
  function changed(knob, how) { turn({ [knob.key]: how }); }
  function showKnobs(list) {
    const open = get("knobs").querySelector("details.mesh[open]") !== null, parts = [[], []], heading = ["", ""];
    knobs = {};
    list.forEach((knob) => {  // those that are turned at once, then those that need another model
      const row = knobRow(knob), at = knob.remeshes ? 1 : 0;
      knobs[knob.key] = row;
      if (knob.group !== heading[at]) { parts[at].push(made("h2", {}, heading[at] = knob.group)); }
      parts[at].push(row);
    });
    const build = made("button", { id: "build", type: "button", disabled: true, onclick: () => ask({ build: "all" }) }, "build model");
    const apply = made("div", { class: "apply" }, build, made("span", { id: "cost" }));
    const mesh = made("details", { class: "mesh", open: open }, made("summary", {}, "The blade itself"), apply, ...parts[1]);
    get("knobs").replaceChildren(...parts[0], ...(parts[1].length ? [mesh] : []));
  }
  function showValues(values) {
    Object.entries(values).forEach(([key, now]) => {
      const row = knobs[key];
      if (!row) { return; }
      row.classList.toggle("changed", now.changed);
      const number = row.querySelector("input[type=number]"), range = row.querySelector("input[type=range]");
      if (range) {
        if (document.activeElement !== number || !flying) { number.value = now.shown; }
        if (!(pending && key in pending.change)) { range.value = now.position; }
        range.setAttribute("aria-valuetext", now.text);
      } else { row.querySelector("select").selectedIndex = now.choice; }
      row.classList.toggle("waits", Boolean(now.waits));
    });
    const costs = Object.values(values).filter((now) => now.waits).map((now) => now.cost);
    if (get("build")) {
      get("build").disabled = !costs.length;
      get("cost").textContent = costs.length ? costs.sort().pop() : "turn what is below, then build";
    }
  }
  function showReadouts(list) {
    get("readouts").replaceChildren(...list.map((one) => {
      const value = made("div", { class: "value" }, one.value, one.unit ? made("small", {}, "\u2009" + one.unit) : "");
      const box = made("div", { class: "readout", "data-name": one.name, "data-value": one.exact }, made("div", { class: "name" }, one.name), value);
      if (one.shares) {
        box.append(made("div", { class: "shares", "aria-hidden": true },
          ...one.shares.map(([state, share]) => made("i", { class: state, style: `width: ${100 * share}%` }))));
      }
      box.append(made("div", { class: "of" }, one.of || "\u00a0"));
      return box;
    }));
  }
  function showSteps(list) {
    get("steps").replaceChildren(...list.map((one) => made("li", { class: one.state, title: one.said }, one.name)));
  }
  function showPins(list) {
    get("pins").replaceChildren(...list.map((one) => made("button", { type: "button", title: "Remove this pinned curve",
      onclick: () => ask({ unpin: one.number }) }, made("span", { style: `background: ${one.colour}` }), one.label + " ×")));
  }
  function showNodes(list) {
    const node = get("node"), chosen = node.value;
    node.replaceChildren(made("option", { value: "all" }, "all"), ...list.map((name, k) => made("option", { value: k }, name)));
    node.value = [...node.options].some((option) => option.value === chosen) ? chosen : "all";
  }
  function save(file) {
    const link = made("a", { download: file.name, href: URL.createObjectURL(new Blob([file.text], { type: file.type })) });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  // The contact face: each node at its place, in the colour of its state at the phase that the blade shows.
  const COLOURS = { stick: "#0072B2", slip: "#C87800", open: "#8c959f" };
  function drawFace() {
    const canvas = get("face"), pen = canvas.getContext("2d"), ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = canvas.clientWidth, height = canvas.clientHeight, below = 18;
    canvas.width = width * ratio; canvas.height = height * ratio;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    if (!nodes) { return; }
    const room = (height - below) / nodes.places.length;
    nodes.places.forEach((place, k) => drawNodes(pen, place, width, room * k, room, nodes.places.length > 1));
    pen.font = "11px sans-serif"; pen.textAlign = "center"; pen.textBaseline = "alphabetic"; pen.fillStyle = "#57606a";
    pen.fillText("phase " + Math.round(angle * 180 / Math.PI) + "°", width / 2, height - 4);
  }
  function drawNodes(pen, place, width, top, room, named) {
    const low = [Math.min(...place.x), Math.min(...place.y)], high = [Math.max(...place.x), Math.max(...place.y)];
    const edge = 30, over = named ? 16 : 0, span = [high[0] - low[0], high[1] - low[1]];
    const scale = Math.min((width - edge) / Math.max(span[0], 1e-9), (room - over - edge) / Math.max(span[1], 1e-9));
    const count = nodes.states[0].length, now = Math.round(angle / (2 * Math.PI) * count) % count;
    const radius = Math.max(3, Math.min(11, 0.3 * Math.min(width, room) / Math.sqrt(place.x.length)));
    pen.font = "11px sans-serif"; pen.textAlign = "center"; pen.textBaseline = "middle"; pen.fillStyle = "#57606a";
    if (named) { pen.fillText(place.name, width / 2, top + 8); }
    place.x.forEach((_, k) => {
      const x = width / 2 + scale * (place.x[k] - (low[0] + high[0]) / 2);
      const y = top + over + (room - over) / 2 - scale * (place.y[k] - (low[1] + high[1]) / 2);
      const state = nodes.names[nodes.states[place.first + k][now]];
      pen.fillStyle = COLOURS[state]; pen.beginPath(); pen.arc(x, y, radius, 0, 2 * Math.PI); pen.fill();
      pen.fillStyle = state === "stick" ? "#fff" : "#000";
      if (radius >= 7) { pen.fillText(String(place.first + k + 1), x, y + 0.5); }
    });
  }

  const SHOWN = {
    number: answered,  // first: a value that was refused does not stay in its field
    title: (text) => { get("title").textContent = document.title = text; },
    about: (text) => { get("about").textContent = text; },
    knobs: showKnobs, values: showValues, readouts: showReadouts, steps: showSteps, pins: showPins, nodes: showNodes, save: save,
    sure: (text) => {  // what was searched is told to those who ask
      const [known, searched] = text.split("; searched: ");
      get("sure").textContent = known + (searched ? "." : "");
      get("searched").hidden = !searched;
      get("searched").querySelector("p").textContent = searched ? "Searched: " + searched : "";
    },
    error: (text) => { get("error").hidden = !text; get("error").textContent = text || ""; },
    at: (text) => { document.querySelectorAll(".at").forEach((one) => { one.textContent = text; }); },
    trail: (text) => { get("trail-title").textContent = text; },
    trailed: (on) => { get("no-trail").hidden = on; },
    found: (text) => { get("found").textContent = text; },
    working: (text) => {
      get("working").hidden = !text;
      get("working").querySelector("span").textContent = text || "";
      document.body.classList.toggle("working", Boolean(text));
    },
    cycle: (text) => { get("cycle-note").textContent = text; },
    faces: (found) => { nodes = found; drawFace(); },
    no_shape: (text) => { get("no-shape").hidden = !text; get("no-shape").textContent = text || ""; get("viewer").hidden = Boolean(text); },
    can: (found) => { Object.entries(found).forEach(([id, may]) => { get(id).disabled = !may; }); },
  };
  function told() {
    const found = JSON.parse(model.told.value || "{}");
    Object.entries(SHOWN).forEach(([name, show]) => { if (name in found) { show(found[name]); } });
  }
  function shaped() {
    const canvas = get("viewer-canvas");
    if (!model.shape.value) { return; }
    canvas.dispatchEvent(new CustomEvent("shapes", { detail: JSON.parse(model.shape.value) }));
    if (get("viewer").hidden) { SHOWN.no_shape("This browser draws nothing in three dimensions (WebGL is off)."); }
  }

  function scaled() {
    const log = get("scale").getAttribute("aria-pressed") !== "true";
    get("scale").setAttribute("aria-pressed", String(log));
    model.log.visible = log;
    model.linear.visible = !log;
  }
  const CLICKS = {
    undo: () => ask({ undo: true }), redo: () => ask({ redo: true }), reset: () => ask({ reset: true }), pin: () => ask({ pin: true }),
    fit: () => ask({ fit: true }), scale: scaled, search: () => ask({ search: true }), stop: () => ask({ stop: true }),
    help: () => get("keys").showModal(),
    "save-scene": () => ask({ save: "scene" }), "save-figure": () => ask({ save: "figure" }), "save-csv": () => ask({ save: "csv" }),
  };
  Object.entries(CLICKS).forEach(([id, act]) => get(id).addEventListener("click", act));
  get("node").addEventListener("change", () => ask({ node: get("node").value }));
  get("response").addEventListener("keydown", (event) => {
    const step = { ArrowLeft: { step: -1 }, ArrowRight: { step: 1 }, PageUp: { step: 10 }, PageDown: { step: -10 }, Home: { pick: "peak" } }[event.key];
    if (step) { event.preventDefault(); ask(step); }
  });
  let pressed = [0, 0];
  get("response").addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; }, true);
  get("response").addEventListener("click", (event) => {  // not the end of a drag
    if (!model || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) { return; }
    const view = Bokeh.index.find_one(model.log.visible ? model.log : model.linear), box = view.el.getBoundingClientRect();
    ask({ place: [view.frame.x_scale.invert(event.clientX - box.left), view.frame.y_scale.invert(event.clientY - box.top)] });
  });
  document.addEventListener("keydown", (event) => {
    const typing = event.target.matches("input[type=number], select, textarea") || get("keys").open;
    const control = event.ctrlKey || event.metaKey, key = event.key.toLowerCase();
    const act = control ? { z: event.shiftKey ? "redo" : "undo", y: "redo" }[key] : typing || event.altKey ? null
      : { p: "pin", l: "scale", 0: "fit", "?": "help" }[key];
    if (act) { event.preventDefault(); if (!get(act).disabled) { CLICKS[act](); } }
  });
  get("viewer-canvas").addEventListener("turned", (event) => { angle = event.detail; if (nodes) { drawFace(); phase(); } });
  let phased = 0;
  function phase() {  // the line in the chart of the cycle follows
    const line = model && model.doc.get_model_by_name("phase");
    if (line && performance.now() - phased > 90) { phased = performance.now(); line.setv({ location: angle * 180 / Math.PI }, { sync: false }); }
  }
  window.addEventListener("resize", drawFace);

  const wait = setInterval(() => {
    const doc = window.Bokeh && Bokeh.documents[0], named = (name) => doc.get_model_by_name(name);
    if (!doc || !named("told")) { return; }
    clearInterval(wait);
    model = { doc: doc, asked: named("asked"), told: named("told"), shape: named("shape"), log: named("response"), linear: named("response_linear") };
    model.told.properties.value.change.connect(told);
    model.shape.properties.value.change.connect(shaped);
    doc.on_event("connection_lost", () => { get("lost").hidden = false; });
    doc.on_event("client_reconnected", () => { get("lost").hidden = true; });
    told();
    shaped();
    ask({ ready: true });
  }, 20);
})();
