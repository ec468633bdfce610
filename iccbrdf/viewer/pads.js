// Directions: pads on which they are dragged, the words for them, and the pictures of the presets.

const SVG = "http://www.w3.org/2000/svg";
const OUTERMOST = Math.sin((88 * Math.PI) / 180);

function svg(parent, name, attributes) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent.append(element);
  return element;
}

function fromAngles(zenith, azimuth) {
  const [t, p] = [zenith, azimuth].map((degrees) => (degrees * Math.PI) / 180);
  return [Math.sin(t) * Math.cos(p), Math.sin(t) * Math.sin(p), Math.cos(t)];
}

// The unit vector above the print whose first two components are these, or as near to them as it may be.
function lifted(x, y) {
  const length = Math.hypot(x, y);
  const factor = length > OUTERMOST ? OUTERMOST / length : 1;
  const [a, b] = [x * factor, y * factor];
  return [a, b, Math.sqrt(1 - a * a - b * b)];
}

function unit(vector) {
  const length = Math.hypot(...vector);
  return vector.map((component) => component / length);
}

const SIDES = ["right", "top right", "top", "top left", "left", "bottom left", "bottom", "bottom right"];

// Zenith angle, as on the command line, and side: "60° left".
function inWords(vector) {
  const zenith = Math.round((Math.acos(Math.min(1, Math.max(-1, vector[2]))) * 180) / Math.PI);
  if (zenith < 3) return "above";
  const side = Math.round((Math.atan2(vector[1], vector[0]) * 4) / Math.PI + 8) % 8;
  return `${zenith}\u00b0 ${SIDES[side]}`;
}

// A hemisphere seen from above, with a knob for each direction.  `moved(which, vector)` is told of drags.
class Pad {
  constructor(element, shape, moved) {
    this.element = element;
    this.shape = shape;
    const defs = svg(element, "defs", {});
    this.shade = svg(defs, "radialGradient", { id: `${element.id}-shade`, cx: 0.5, cy: 0.5, r: 0.72 });
    const stops = shape === "lamp"
      ? [[0, "#f4f4f4"], [0.5, "#868686"], [1, "#333"]]
      : [[0, "#5a5a5a"], [1, "#3a3a3a"]];
    for (const [offset, colour] of stops) svg(this.shade, "stop", { offset, "stop-color": colour });
    svg(element, "circle", { r: 100, fill: `url(#${element.id}-shade)` });
    for (const zenith of [30, 60]) {
      svg(element, "circle", { r: 100 * Math.sin((zenith * Math.PI) / 180), class: "ring" });
    }
    svg(element, "circle", { r: 100, class: "rim" });
    this.knobs = [];
    this.held = null;
    element.addEventListener("pointerdown", (event) => {
      this.held = this.nearest(this.at(event));
      element.setPointerCapture(event.pointerId);
      moved(this.held, this.at(event));
    });
    element.addEventListener("pointermove", (event) => {
      if (this.held !== null) moved(this.held, this.at(event));
    });
    for (const end of ["pointerup", "pointercancel"]) {
      element.addEventListener(end, () => { this.held = null; });
    }
  }

  at(event) {
    const box = this.element.getBoundingClientRect();
    const scale = box.width / 220;
    return lifted((event.clientX - box.x - box.width / 2) / (100 * scale),
      (box.y + box.height / 2 - event.clientY) / (100 * scale));
  }

  nearest([x, y]) {
    const distances = this.vectors.map((vector) => Math.hypot(vector[0] - x, vector[1] - y));
    return distances.indexOf(Math.min(...distances));
  }

  show(vectors, active) {
    this.vectors = vectors;
    while (this.knobs.length > vectors.length) this.knobs.pop().remove();
    while (this.knobs.length < vectors.length) this.knobs.push(this.knob());
    vectors.forEach((vector, k) => {
      this.knobs[k].setAttribute("transform", `translate(${100 * vector[0]} ${-100 * vector[1]})`);
      this.knobs[k].setAttribute("class", vectors.length > 1 && k !== active ? "idle" : "");
      this.knobs[k].querySelector("text").textContent = vectors.length > 1 ? "AB"[k] : "";
    });
    const [x, y] = vectors[active];
    if (this.shape === "lamp") {
      this.shade.setAttribute("fx", 0.5 + 0.45 * x);
      this.shade.setAttribute("fy", 0.5 - 0.45 * y);
    }
    this.element.setAttribute("aria-description", inWords(vectors[active]));
  }

  knob() {
    const group = svg(this.element, "g", {});
    if (this.shape === "lamp") {
      for (let k = 0; k < 8; k++) {
        svg(group, "line", { class: "ray", x1: 18, x2: 24, y1: 0, y2: 0, transform: `rotate(${45 * k})` });
      }
      svg(group, "circle", { r: 13, class: "knob" });
    } else {
      svg(group, "path", { class: "knob", d: "M-24 0 Q0 -24 24 0 Q0 24 -24 0Z" });
      svg(group, "circle", { r: 6, fill: "#1a1a1a" });
    }
    svg(group, "text", {});
    return group;
  }
}

// Light and view as zenith and azimuth in degrees; lamp and eye are where they stand in the button's picture.
const PRESETS = [
  {
    name: "Left", title: "Raking light from the left (1)",
    light: [74, 180], view: [0, 0], lamp: [-15, -4], eye: [0, -20],
  },
  {
    name: "Right", title: "Raking light from the right (2)",
    light: [74, 0], view: [0, 0], lamp: [15, -4], eye: [0, -20],
  },
  {
    name: "Top", title: "Raking light from the top (3)",
    light: [74, 90], view: [0, 0], lamp: [6, -7], eye: [0, -20],
  },
  {
    name: "0/45", title: "Light at 45 degrees, seen from above, as prints are measured (4)",
    light: [45, 180], view: [0, 0], lamp: [-13, -13], eye: [0, -20],
  },
  {
    name: "Mirror", title: "Seen where a flat print mirrors the light (5)",
    light: [40, 90], view: [40, 270], lamp: [-12, -15], eye: [12, -15],
  },
];

// From the side: a print, the lamp and its beam, and the way to the eye.
function presetPicture(button, preset) {
  const picture = svg(button, "svg", { viewBox: "-17 -22 34 26", "aria-hidden": "true" });
  svg(picture, "line", { class: "print", x1: -16, x2: 16, y1: 2, y2: 2 });
  svg(picture, "line", { class: "beam", x1: preset.lamp[0], y1: preset.lamp[1], x2: 0, y2: 0 });
  svg(picture, "line", {
    class: "beam", x1: 0, y1: 0, x2: preset.eye[0], y2: preset.eye[1], "stroke-dasharray": "2 2.4",
  });
  svg(picture, "circle", { class: "lamp", cx: preset.lamp[0], cy: preset.lamp[1], r: 3.6 });
}
