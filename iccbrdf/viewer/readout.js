// What is under the pointer: XYZ, Lab, slope and reflection parameters.

function toLab(xyz, white) {
  const [x, y, z] = xyz.map((value, k) => {
    const t = value / white[k];
    return t > (6 / 29) ** 3 ? Math.cbrt(t) : (t * (29 / 6) ** 2) / 3 + 4 / 29;
  });
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

// The pixel's numbers, computed as the picture is: { xyz, lab, slope, parameters }.
function pixelValues(page, layers, program, env, column, row) {
  const position = row * page.width + column;
  const channels = layers.map((codes, k) => {
    const code = codes[position];
    return code === 65535 ? NaN : (code - page.zeros[k]) * page.scales[k];
  });
  const [x, y, z, ...multiplex] = FUNCTIONS[program].pixel(env, channels);
  const parameters = new Map();
  page.multiplex.forEach((name, k) => {
    const family = name.split(".")[0];
    parameters.set(family, [...(parameters.get(family) ?? []), multiplex[k]]);
  });
  const normal = parameters.get("n");
  parameters.delete("n");
  let slope = null;
  if (normal?.length === 3 && Math.hypot(...normal) > 0) {
    const vector = unit(normal);
    slope = {
      angle: (Math.atan2(Math.hypot(vector[0], vector[1]), vector[2]) * 180) / Math.PI,
      side: (Math.atan2(vector[1], vector[0]) * 180) / Math.PI,
    };
  }
  return { xyz: [x, y, z], lab: toLab([x, y, z], page.white), slope, parameters };
}

function showReadout(element, values) {
  element.replaceChildren();
  const cell = (text, kind, ...classes) => {
    const item = document.createElement(kind);
    item.textContent = text;
    item.classList.add(...classes);
    element.append(item);
  };
  const row = (name, numbers, digits, ...classes) => {
    cell(name, "b", ...classes);
    const texts = numbers.map((value) => (Number.isFinite(value) ? value.toFixed(digits) : "\u2013"));
    if (numbers.length === 3) texts.forEach((text) => cell(text, "span", ...classes));
    else cell(texts.join("  "), "span", "wide", ...classes);
  };
  row("XYZ", values.xyz.map((value) => 100 * value), 1);
  row("Lab", values.lab, 1);
  if (values.slope) {
    cell("slope", "b");
    const { angle, side } = values.slope;
    const downhill = `${angle.toFixed(1)}\u00b0 to the ${SIDES[Math.round(side / 45 + 8) % 8]}`;
    cell(angle < 0.05 ? "flat" : downhill, "span", "wide");
  }
  for (const [family, numbers] of values.parameters) row(family, numbers, 3, "detail");
}
