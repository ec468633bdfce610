// Draws the print with WebGL 2; one program for each choice of effects, compiled when it is first used.

const VERTEX = `#version 300 es
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}`;

const UNIFORMS = [
  "image", "table", "u", "place", "rows", "exposure", "soft", "surround", "taps", "measuring",
];

class Renderer {
  constructor(canvas, page, layers) {
    this.canvas = canvas;
    this.page = page;
    this.layers = layers;
    const wanted = { alpha: false, antialias: false, powerPreference: "high-performance" };
    const gl = canvas.getContext("webgl2", wanted);
    if (!gl) {
      throw new Error("This print needs WebGL 2, which this browser does not have or has switched off.");
    }
    this.gl = gl;
    this.start();
  }

  // Everything that a lost context takes with it.
  start() {
    const { gl, page } = this;
    const limit = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    const longest = Math.max(page.width, page.height);
    if (longest > limit) {
      throw new Error(`This device shows prints of up to ${limit} pixels across; this one has ${longest}.`);
    }
    if ("drawingBufferColorSpace" in gl) gl.drawingBufferColorSpace = page.display.canvas;
    this.programs = new Map();
    this.target = null;
    gl.bindVertexArray(gl.createVertexArray());
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 2);
    gl.activeTexture(gl.TEXTURE0);
    this.texture(gl.TEXTURE_2D_ARRAY, gl.NEAREST);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.R16UI, page.width, page.height, this.layers.length);
    this.layers.forEach((codes, k) => gl.texSubImage3D(
      gl.TEXTURE_2D_ARRAY, 0, 0, 0, k, page.width, page.height, 1, gl.RED_INTEGER, gl.UNSIGNED_SHORT, codes));
    if (page.display.table) {
      const { nodes } = page.display;
      gl.activeTexture(gl.TEXTURE1);
      this.texture(gl.TEXTURE_3D, gl.LINEAR);
      gl.texImage3D(gl.TEXTURE_3D, 0, gl.RGBA16F, nodes, nodes, nodes, 0, gl.RGBA, gl.HALF_FLOAT,
        readTable(page.display.table));
    }
  }

  texture(target, filter) {
    const { gl } = this;
    gl.bindTexture(target, gl.createTexture());
    gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, filter);
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) {
      gl.texParameteri(target, wrap, gl.CLAMP_TO_EDGE);
    }
  }

  // The program of an index, in use, with its arguments set.
  use(index, env) {
    const { gl } = this;
    let entry = this.programs.get(index);
    if (!entry) {
      const program = gl.createProgram();
      const fragment = this.page.programs[index].shader;
      for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, fragment]]) {
        const shader = gl.createShader(kind);
        gl.shaderSource(shader, text);
        gl.compileShader(shader);
        gl.attachShader(program, shader);
      }
      gl.linkProgram(program);
      if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
        const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
        throw new Error(`This device's graphics driver refuses the print: ${logs.join(" ")}`);
      }
      const at = Object.fromEntries(UNIFORMS.map((name) => [name, gl.getUniformLocation(program, name)]));
      entry = { program, at };
      this.programs.set(index, entry);
    }
    gl.useProgram(entry.program);
    gl.uniform1i(entry.at.image, 0);
    gl.uniform1i(entry.at.table, 1);
    const values = FUNCTIONS[index].uniforms(env).map(Number);
    if (values.length) gl.uniform1fv(entry.at.u, values);
    return entry.at;
  }

  // views: { program, env, from, to } of columns of the canvas; camera: column and row of the image under the
  // first pixel, and pixels of the image a pixel.
  draw(views, camera, exposure, soft, taps) {
    const { gl, canvas } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.enable(gl.SCISSOR_TEST);
    for (const view of views) {
      if (view.to <= view.from) continue;
      gl.scissor(view.from, 0, view.to - view.from, canvas.height);
      this.picture(this.use(view.program, view.env), camera, canvas.height, exposure, soft, taps);
    }
    gl.disable(gl.SCISSOR_TEST);
  }

  picture(at, camera, rows, exposure, soft, taps) {
    const { gl } = this;
    gl.uniform1i(at.measuring, 0);
    gl.uniform3f(at.place, camera.column, camera.row, camera.scale);
    gl.uniform1f(at.rows, rows);
    gl.uniform1f(at.exposure, exposure);
    gl.uniform1i(at.soft, soft);
    gl.uniform3f(at.surround, SURROUND, SURROUND, SURROUND);
    gl.uniform1i(at.taps, taps);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  // Calls `then` as soon as everything that was asked for is drawn.
  finished(then) {
    const { gl } = this;
    const sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    const look = () => {
      if (gl.isContextLost()) return;
      if (gl.clientWaitSync(sync, 0, 0) === gl.TIMEOUT_EXPIRED) {
        setTimeout(look, 1);
        return;
      }
      gl.deleteSync(sync);
      then();
    };
    look();
  }

  // XYZ under D50 of a rectangle of the image, before the display: 4 floats a pixel, the first row first.
  measure(program, env, x, y, width, height) {
    const { gl } = this;
    if (!gl.getExtension("EXT_color_buffer_float")) return null;
    this.offscreen(gl.RGBA32F, width, height);
    const at = this.use(program, env);
    gl.uniform1i(at.measuring, 1);
    gl.uniform1i(at.taps, 1);
    gl.uniform3f(at.place, x, y, 1);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const result = new Float32Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, result);
    return result;
  }

  // Levels of the display in a rectangle of the image: 4 bytes a pixel, the last row first.
  levels(program, env, exposure, soft, x, y, width, height) {
    const { gl } = this;
    this.offscreen(gl.RGBA8, width, height);
    this.picture(this.use(program, env), { column: x, row: y, scale: 1 }, height, exposure, soft, 1);
    const result = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, result);
    return result;
  }

  offscreen(format, width, height) {
    const { gl } = this;
    if (this.target) {
      gl.deleteFramebuffer(this.target.frame);
      gl.deleteRenderbuffer(this.target.buffer);
    }
    const frame = gl.createFramebuffer(), buffer = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
    gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, buffer);
    gl.viewport(0, 0, width, height);
    this.target = { frame, buffer };
  }
}
