// The page: what is set, what follows from it, and the controls that set it.

const page = JSON.parse(document.getElementById("page").textContent);
const byId = (id) => document.getElementById(id);
const stage = byId("stage"), canvas = byId("picture");
const SURROUND = 0x38 / 255;
const COMPARE = [["none", "One"], ["lights", "Two lights"], ["flat", "Flat"]];
const EFFECT_NAMES = {
  relief: "Relief", gloss: "Gloss", "gloss-colour": "Gloss colour", "slope-colour": "Colour on slopes",
};
const STILL_AFTER = 180; // ms without a change, after which the picture is drawn at its best
const SLOW = 45; // ms a frame, from which a moving picture is drawn coarser
const LOWEST = 0.1; // cosine of the lowest light that the automatic lamp makes up for

const initial = () => ({
  lights: [unit(page.light), mirrored(unit(page.light))],
  active: 0,
  view: unit(page.view),
  intensity: 0,
  ...page.start,
  without: new Set(),
  compare: "none",
  divider: 0.5,
});
const mirrored = ([x, y, z]) => (Math.hypot(x, y) < 0.05 ? fromAngles(60, 0) : [-x, -y, z]);

const ratioOf = () => window.devicePixelRatio || 1;

let state = initial();
let camera = { x: page.width / 2, y: page.height / 2, scale: 1, fitted: true };
let renderer = null, layers = [], pointer = null;
let asked = false, inFlight = false, refined = false, refining = 0;
let changedAt = 0, frameTime = null, coarse = 1;

// What is drawn ------------------------------------------------------------------------------------------

function envOf(k) {
  const env = { ...page.env };
  const set = (names, vector) => names.forEach((name, i) => {
    if (page.variables.includes(name)) env[name] = vector[i];
  });
  set(["litX", "litY", "litZ"], state.lights[k]);
  set(["vueX", "vueY", "vueZ"], state.view);
  if (page.intensity !== null) {
    const sunk = state.auto ? Math.max(LOWEST, state.lights[k][2]) : 1;
    env.litI = (page.intensity * 2 ** state.intensity) / sunk;
  }
  return env;
}

const programOf = (without) => page.of[[...without].sort().join(",")];

// One view, or two side by side: { program, env, from, to } with columns of the canvas.
function views() {
  const split = Math.round(state.divider * canvas.width);
  const shown = state.compare === "lights" ? 0 : state.active;
  const left = { program: programOf(state.without), env: envOf(shown) };
  if (state.compare === "none") return [{ ...left, from: 0, to: canvas.width }];
  const right = state.compare === "lights"
    ? { program: left.program, env: envOf(1) }
    : { program: programOf(new Set([...state.without, "relief"])), env: left.env };
  return [{ ...left, from: 0, to: split }, { ...right, from: split, to: canvas.width }];
}

function change() {
  changedAt = performance.now();
  refined = false;
  ask();
}

function ask() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(frame);
}

// One frame at a time: what changes while the graphics processor works is in the next one.
function frame() {
  if (inFlight) return;
  asked = false;
  if (!renderer || renderer.gl.isContextLost()) return;
  const still = performance.now() - changedAt > STILL_AFTER;
  clearTimeout(refining);
  if (!still) refining = setTimeout(ask, STILL_AFTER + 20);
  inFlight = true;
  const begun = performance.now(), compiled = renderer.programs.size;
  draw(still);
  renderer.finished(() => {
    inFlight = false;
    if (still && changedAt < begun) refined = true;
    // The first frame of a program is the compiler's time.
    if (!still && renderer.programs.size === compiled) measured(performance.now() - begun);
    if (asked) requestAnimationFrame(frame);
  });
}

// The time of a frame while the picture moves; slow devices then draw it coarser.
function measured(time) {
  frameTime = frameTime === null ? time : 0.7 * frameTime + 0.3 * time;
  if (frameTime > SLOW && coarse < 4) {
    coarse *= 2;
    frameTime = null;
  }
  showCost();
}

// Sizes the canvas, `shrink` times coarser than the window; gives the camera as the renderer has it.
function framed(shrink) {
  const width = Math.max(1, Math.round((stage.clientWidth * ratioOf()) / shrink));
  const height = Math.max(1, Math.round((stage.clientHeight * ratioOf()) / shrink));
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const scale = camera.scale * shrink;
  return { column: camera.x - (width / 2) * scale, row: camera.y - (height / 2) * scale, scale };
}

function draw(still) {
  const place = framed(still ? 1 : coarse);
  const { scale } = place;
  const finest = scale > 1 ? Math.min(4, Math.ceil(scale)) : Number.isInteger(1 / scale) ? 1 : 2;
  renderer.draw(views(), place, 2 ** state.exposure, state.soft, still ? finest : Math.min(finest, 2));
}

// Zoom and pan -------------------------------------------------------------------------------------------

function fit() {
  const [width, height] = [stage.clientWidth * ratioOf(), stage.clientHeight * ratioOf()];
  const scale = Math.max(page.width / (width * 0.94), page.height / (height * 0.94));
  camera = { x: page.width / 2, y: page.height / 2, scale, fitted: true };
  showZoom();
}

// Makes the print larger by `factor` around a place of the window.
function zoom(factor, clientX, clientY) {
  const box = stage.getBoundingClientRect();
  const [dx, dy] = [
    ((clientX ?? box.x + box.width / 2) - box.x - box.width / 2) * ratioOf(),
    ((clientY ?? box.y + box.height / 2) - box.y - box.height / 2) * ratioOf(),
  ];
  const scale = Math.min(16, Math.max(1 / 32, camera.scale / factor));
  pan(dx * (scale - camera.scale), dy * (scale - camera.scale));
  camera.scale = scale;
  showZoom();
}

// Moves the print by pixels of the image; its middle stays in sight.
function pan(dx, dy) {
  camera.x = Math.min(page.width, Math.max(0, camera.x - dx));
  camera.y = Math.min(page.height, Math.max(0, camera.y - dy));
  camera.fitted = false;
  change();
}

function showZoom() {
  byId("zoom-value").textContent = `${Math.round(100 / camera.scale)} %`;
  change();
}

// The pixel of the image at a place of the window, and in which view; null beside the print.
function pixelAt(clientX, clientY) {
  const box = stage.getBoundingClientRect();
  const column = Math.floor(camera.x + (clientX - box.x - box.width / 2) * ratioOf() * camera.scale);
  const row = Math.floor(camera.y + (clientY - box.y - box.height / 2) * ratioOf() * camera.scale);
  if (column < 0 || row < 0 || column >= page.width || row >= page.height) return null;
  const right = state.compare !== "none" && (clientX - box.x) / box.width >= state.divider;
  return { column, row, view: views()[right ? 1 : 0] };
}

function listenToPicture() {
  const touches = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    touches.set(event.pointerId, event);
    pointer = [event.clientX, event.clientY];
    showPixel();
  });
  canvas.addEventListener("pointermove", (event) => {
    pointer = [event.clientX, event.clientY];
    showPixel();
    const before = touches.get(event.pointerId);
    if (!before) return;
    const step = ratioOf() * camera.scale;
    const [dx, dy] = [(event.clientX - before.clientX) * step, (event.clientY - before.clientY) * step];
    if (touches.size === 1) pan(dx, dy);
    if (touches.size === 2) {
      const other = [...touches.values()].find((touch) => touch.pointerId !== event.pointerId);
      const apart = (touch) => Math.hypot(touch.clientX - other.clientX, touch.clientY - other.clientY) || 1;
      const middle = [(event.clientX + other.clientX) / 2, (event.clientY + other.clientY) / 2];
      pan(dx / 2, dy / 2);
      zoom(apart(event) / apart(before), ...middle);
    }
    touches.set(event.pointerId, event);
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, (event) => {
      touches.delete(event.pointerId);
      if (event.pointerType === "touch") pointer = null;
      showPixel();
    });
  }
  canvas.addEventListener("pointerleave", (event) => {
    if (event.pointerType === "mouse") pointer = null;
    showPixel();
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(-event.deltaY * (event.ctrlKey ? 0.01 : 0.0015)), event.clientX, event.clientY);
  }, { passive: false });
  canvas.addEventListener("dblclick", (event) => {
    if (camera.fitted) zoom(camera.scale, event.clientX, event.clientY);
    else fit();
  });
  byId("zoom-in").addEventListener("click", () => zoom(1.5));
  byId("zoom-out").addEventListener("click", () => zoom(1 / 1.5));
  byId("zoom-fit").addEventListener("click", fit);
  new ResizeObserver(() => (camera.fitted ? fit() : change())).observe(stage);
}

// Controls -----------------------------------------------------------------------------------------------

let lightPad = null, viewPad = null;

function setLight(vector, which = state.active) {
  state.active = which;
  state.lights[which] = vector;
  update();
}

function setView(vector) {
  state.view = vector;
  update();
}

function button(parent, className, text, clicked) {
  const element = document.createElement("button");
  element.type = "button";
  element.className = className;
  element.textContent = text;
  element.addEventListener("click", clicked);
  parent.append(element);
  return element;
}

function toggle(parent, text, turned) {
  const element = button(parent, "switch", "", () => {
    turned();
    update();
  });
  element.setAttribute("role", "switch");
  element.append(document.createElement("i"), text, document.createElement("small"));
  return element;
}

function applyPreset(preset) {
  if (page.variables.includes("vueZ")) state.view = fromAngles(...preset.view);
  setLight(fromAngles(...preset.light));
}

function setCompare(value) {
  state.compare = value;
  if (value !== "lights") state.active = 0;
  update();
}

function listenToDivider() {
  const divider = byId("divider");
  const move = (share) => {
    state.divider = Math.min(0.98, Math.max(0.02, share));
    update();
  };
  divider.addEventListener("pointerdown", (event) => divider.setPointerCapture(event.pointerId));
  divider.addEventListener("pointermove", (event) => {
    const box = stage.getBoundingClientRect();
    if (divider.hasPointerCapture(event.pointerId)) move((event.clientX - box.x) / box.width);
  });
  divider.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
    if (!step) return;
    move(state.divider + step);
    event.stopPropagation();
    event.preventDefault();
  });
}

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

function onKey(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || byId("help").open) return;
  if (ARROWS[event.key] && event.target.type !== "range") {
    const step = ARROWS[event.key].map((direction) => 0.035 * direction);
    const [x, y] = event.shiftKey || event.target.id === "view" ? state.view : state.lights[state.active];
    const moved = lifted(x + step[0], y + step[1]);
    if (event.shiftKey || event.target.id === "view") setView(moved);
    else setLight(moved);
  } else if (PRESETS[Number(event.key) - 1]) {
    applyPreset(PRESETS[Number(event.key) - 1]);
  } else if (event.key === "+" || event.key === "=") {
    zoom(1.5);
  } else if (event.key === "-") {
    zoom(1 / 1.5);
  } else if (event.key === "0") {
    fit();
  } else if (event.key === "c") {
    const values = compareChoices().map(([value]) => value);
    setCompare(values[(values.indexOf(state.compare) + 1) % values.length]);
  } else if (event.key === "r") {
    reset();
  } else if (event.key === "?") {
    byId("help").showModal();
  } else {
    return;
  }
  event.preventDefault();
}

function reset() {
  state = initial();
  fit();
  update();
}

const compareChoices = () => COMPARE.filter(([value]) => value !== "flat" || page.effects.includes("relief"));

function build() {
  lightPad = new Pad(byId("light"), "lamp", (which, vector) => setLight(vector, which));
  viewPad = new Pad(byId("view"), "eye", (which, vector) => setView(vector));
  byId("view").closest("figure").hidden = !page.variables.includes("vueZ");
  for (const preset of PRESETS) {
    const element = button(byId("presets"), "", "", () => applyPreset(preset));
    element.title = preset.title;
    presetPicture(element, preset);
    element.append(preset.name);
  }
  byId("intensity-row").hidden = page.intensity === null;
  for (const name of ["intensity", "exposure"]) {
    byId(name).addEventListener("input", (event) => {
      state[name] = Number(event.target.value);
      update();
    });
  }
  for (const [value, text] of compareChoices()) {
    const element = button(byId("compare"), "", text, () => setCompare(value));
    element.setAttribute("role", "radio");
    element.dataset.value = value;
  }
  const auto = toggle(byId("switches"), "Auto lamp", () => { state.auto = !state.auto; });
  auto.id = "auto";
  auto.title = "The lower the lamp, the brighter: a flat print stays as it is";
  auto.hidden = page.intensity === null;
  const soft = toggle(byId("switches"), "Soft highlights", () => { state.soft = !state.soft; });
  soft.id = "soft";
  soft.title = "Highlights above white are compressed instead of cut off";
  for (const effect of page.effects) {
    const element = toggle(byId("effects"), EFFECT_NAMES[effect], () => {
      if (!state.without.delete(effect)) state.without.add(effect);
    });
    element.dataset.effect = effect;
  }
  byId("size").textContent = page.size;
  byId("about").textContent = page.about;
  byId("reset").addEventListener("click", reset);
  byId("help-button").addEventListener("click", () => byId("help").showModal());
  document.addEventListener("keydown", onKey);
  listenToPicture();
  listenToDivider();
}

function update() {
  if (state.compare === "lights") lightPad.show(state.lights, state.active);
  else lightPad.show([state.lights[state.active]], 0);
  viewPad.show([state.view], 0);
  byId("light-value").textContent = inWords(state.lights[state.active]);
  byId("view-value").textContent = inWords(state.view);
  for (const name of ["intensity", "exposure"]) {
    byId(name).value = state[name];
    byId(`${name}-value`).textContent = `\u00d7${(2 ** state[name]).toFixed(2)}`;
  }
  for (const element of byId("compare").children) {
    element.setAttribute("aria-checked", element.dataset.value === state.compare);
  }
  byId("divider").hidden = state.compare === "none";
  byId("divider").style.left = `${100 * state.divider}%`;
  const names = { lights: ["A", "B"], flat: ["Relief", "Flat"] }[state.compare];
  ["half-left", "half-right"].forEach((id, k) => {
    byId(id).hidden = !names;
    byId(id).textContent = names?.[k] ?? "";
  });
  for (const name of ["auto", "soft"]) byId(name).setAttribute("aria-checked", state[name]);
  showEffects();
  showCost();
  showPixel();
  change();
}

const operations = (without) => page.programs[programOf(without)].operations;

function showEffects() {
  for (const element of byId("effects").querySelectorAll("button")) {
    const { effect } = element.dataset;
    const others = new Set(state.without);
    others.delete(effect);
    const [more, less] = [operations(others), operations(new Set([...others, effect]))];
    element.setAttribute("aria-checked", !state.without.has(effect));
    element.disabled = more === less;
    const share = `${Math.round((100 * (more - less)) / more)} %`;
    element.querySelector("small").textContent = more === less ? "" : share;
    element.title = `${more} operations a pixel with it, ${less} without`;
  }
}

function showCost() {
  const time = frameTime === null ? "" : `, ${Math.round(frameTime)} ms`;
  byId("cost").textContent = `${operations(state.without)} operations a pixel${time}`;
}

function showPixel() {
  const pixel = pointer && renderer && pixelAt(...pointer);
  byId("readout").hidden = !pixel;
  if (!pixel) return;
  const { column, row, view } = pixel;
  showReadout(byId("readout"), pixelValues(page, layers, view.program, view.env, column, row));
}

// Start --------------------------------------------------------------------------------------------------

function say(text) {
  byId("message").textContent = text;
  byId("message").hidden = !text;
}

async function start() {
  build();
  update();
  layers = await readLayers(page, (share) => say(`Opening the print\u2026 ${Math.round(100 * share)} %`));
  renderer = new Renderer(canvas, page, layers);
  canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    say("The graphics driver was interrupted. The print comes back as soon as it does.");
  });
  canvas.addEventListener("webglcontextrestored", () => {
    renderer.start();
    inFlight = asked = false;
    say("");
    change();
  });
  say("");
  fit();
  return renderer;
}

const ready = start();
ready.catch((error) => say(error.message));
// For scripts that drive or measure the page.
globalThis.proof = {
  ready, page,
  set: (changes) => { Object.assign(state, changes); update(); },
  program: (...without) => programOf(without),
  get renderer() { return renderer; },
  pixel: (program, env, column, row) => pixelValues(page, layers, program, env, column, row),
  // Resolves when everything that was changed is on the canvas, at its best.
  settled: async () => {
    while (!refined) await new Promise((resolve) => setTimeout(resolve, 20));
  },
  // The print fills the window.
  fill: () => {
    const scale = Math.min(page.width / canvas.width, page.height / canvas.height);
    camera = { ...camera, scale, fitted: false };
    change();
  },
  // Milliseconds of frames, one place a pixel, between which the light moves.
  times: async (count) => {
    await globalThis.proof.settled();
    const found = [];
    for (let k = 0; k < count; k++) {
      state.lights[state.active] = fromAngles(50, (360 * k) / count);
      const begun = performance.now();
      const place = framed(1);
      renderer.draw(views(), place, 1, false, 1);
      await new Promise((resolve) => renderer.finished(resolve));
      found.push(performance.now() - begun);
    }
    return found;
  },
};
