// The channels of the print: from base64 text to 16-bit codes.

async function unpacked(text, width, height) {
  const zipped = Uint8Array.fromBase64
    ? Uint8Array.fromBase64(text)
    : Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  const stream = new Blob([zipped]).stream().pipeThrough(new DecompressionStream("gzip"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = width * height;
  if (planes.length !== 2 * count) throw new Error("The page is damaged: a channel is incomplete.");
  const codes = new Uint16Array(count);
  for (let start = 0; start < count; start += width) {
    let code = 0;
    for (let i = start; i < start + width; i++) {
      code = (code + planes[i] + (planes[count + i] << 8)) & 0xffff;
      codes[i] = code;
    }
  }
  return codes;
}

async function readLayers(page, progress) {
  const layers = [];
  for (const element of [...document.getElementById("layers").children]) {
    const text = element.dataset.codes;
    element.remove();
    layers.push(await unpacked(text, page.width, page.height));
    progress(layers.length / page.channels.length);
  }
  return layers;
}

// Half floats of the display's table.
function readTable(text) {
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  return new Uint16Array(bytes.buffer);
}
