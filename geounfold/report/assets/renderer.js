// Drawing with WebGL 2: blocks as instanced boxes, holes as ribbons, samples as dots.

const FEW_DOTS = 1500; // samples drawn at most, so that the body shows between them
const WIDE = 2048; // texels a row; block k is texel k
const COMMON = `#version 300 es
precision highp float; precision highp int;
precision highp usampler2D; precision highp isampler2D;
uniform mat3 turn; uniform vec2 scale, shift; uniform float deep;
vec4 seen(vec3 place) {
  vec3 p = turn * place;
  return vec4(p.xy * scale + shift, -p.z * deep, 1.0);
}`;

const BLOCK_VERTEX = `${COMMON}
layout(location=0) in vec3 corner; layout(location=1) in vec2 side;
layout(location=2) in uint block;
uniform usampler2D places, sizes; uniform isampler2D gradients; uniform sampler2D shades;
uniform vec3 origin, spacing, sides, smallest, sizing; uniform float unit, grow;
uniform bool bent, sized; uniform mat3 axes;
out vec2 across; out vec3 eye; flat out float shade; flat out uint id;
ivec2 texel(uint k) { return ivec2(int(k) % ${WIDE}, int(k) / ${WIDE}); }
void main() {
  vec3 d = corner * grow * (sized
    ? smallest + sizing * vec3(texelFetch(sizes, texel(block), 0).xyz) : sides);
  if (bent) {
    vec3 row0 = vec3(texelFetch(gradients, texel(3u * block), 0).xyz);
    vec3 row1 = vec3(texelFetch(gradients, texel(3u * block + 1u), 0).xyz);
    vec3 row2 = vec3(texelFetch(gradients, texel(3u * block + 2u), 0).xyz);
    d = unit * vec3(dot(row0, d), dot(row1, d), dot(row2, d));
  } else {
    d = axes * d;
  }
  vec3 place = origin + spacing * vec3(texelFetch(places, texel(block), 0).xyz) + d;
  across = side; shade = texelFetch(shades, texel(block), 0).x; id = block + 1u;
  eye = turn * place;
  gl_Position = seen(place);
}`;

const BLOCK_FRAGMENT = `#version 300 es
precision highp float; precision highp int;
in vec2 across; in vec3 eye; flat in float shade; flat in uint id;
uniform sampler2D table; uniform int mode; uniform vec3 plain; uniform bool edges;
layout(location=0) out vec4 colour;
void main() {
  if (mode == 1) {
    colour = vec4(id & 255u, (id >> 8u) & 255u, (id >> 16u) & 255u, (id >> 24u) & 255u) / 255.0;
    return;
  }
  vec3 base = plain;
  if (mode == 0) {
    base = shade < 0.0 ? vec3(0.5)
      : texelFetch(table, ivec2(min(255, int(shade * 256.0)), 0), 0).xyz;
  }
  vec3 normal = normalize(cross(dFdx(eye), dFdy(eye)));
  float light = 0.74 + 0.26 * max(0.0, dot(normal, normalize(vec3(-0.35, 0.75, 0.55))));
  vec2 wide = fwidth(across);
  vec2 rim = min(across, 1.0 - across) / max(wide, vec2(1e-6));
  float big = clamp((1.0 / max(max(wide.x, wide.y), 1e-6) - 4.0) / 12.0, 0.0, 1.0);
  float line = edges ? 0.45 * big * (1.0 - smoothstep(0.4, 1.4, min(rim.x, rim.y))) : 0.0;
  colour = vec4(base * light * (1.0 - line), 1.0);
}`;

const RIBBON_VERTEX = `${COMMON}
layout(location=0) in vec2 corner; layout(location=1) in vec3 from; layout(location=2) in vec3 to;
uniform vec2 pixel; uniform float wide;
void main() {
  vec4 a = seen(from), b = seen(to);
  vec2 along = (b.xy - a.xy) / pixel;
  along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
  vec4 p = corner.x < 0.5 ? a : b;
  p.xy += (vec2(-along.y, along.x) * corner.y + along * (corner.x * 2.0 - 1.0) * 0.5)
    * wide * pixel;
  gl_Position = p;
}`;

const DOT_VERTEX = `${COMMON}
layout(location=0) in vec3 place; layout(location=1) in float value;
uniform float wide;
flat out float shade;
void main() {
  shade = value;
  gl_Position = seen(place); gl_PointSize = wide;
}`;

const SHEET_VERTEX = `${COMMON}
layout(location=0) in vec3 place;
void main() { gl_Position = seen(place); }`;

const FLAT_FRAGMENT = `#version 300 es
precision highp float; precision highp int;
uniform vec4 plain; layout(location=0) out vec4 colour;
void main() { colour = vec4(plain.rgb * plain.a, plain.a); }`;

const DOT_FRAGMENT = `#version 300 es
precision highp float; precision highp int;
flat in float shade;
uniform sampler2D table; uniform vec4 plain;
layout(location=0) out vec4 colour;
void main() {
  float r = length(gl_PointCoord - 0.5);
  if (r > 0.5) discard;
  vec3 base = shade < -1.5 ? plain.rgb : shade < 0.0 ? vec3(0.5)
    : texelFetch(table, ivec2(min(255, int(shade * 256.0)), 0), 0).xyz;
  if (r > 0.4) base *= 0.35;
  colour = vec4(base * plain.a, plain.a);
}`;

// Numbers below a count in an order whose beginning is spread evenly: steps of the golden section.
function spread(count) {
  const share = new Float64Array(count);
  for (let k = 0; k < count; k++) share[k] = (k * 0.6180339887498949) % 1;
  return Uint32Array.from(share.keys()).sort((a, b) => share[a] - share[b]);
}

// A box of side 1: corners and places on the side, two triangles each, counter-clockwise outside.
function boxVertices() {
  const out = [];
  for (let axis = 0; axis < 3; axis++) {
    for (const sign of [-1, 1]) {
      const u = (axis + 1) % 3, v = (axis + 2) % 3;
      const loop = [[0, 0], [1, 0], [1, 1], [0, 1]];
      const order = sign > 0 ? [0, 1, 2, 0, 2, 3] : [0, 2, 1, 0, 3, 2];
      for (const i of order) {
        const p = [0, 0, 0];
        p[axis] = 0.5 * sign;
        p[u] = loop[i][0] - 0.5;
        p[v] = loop[i][1] - 0.5;
        out.push(...p, ...loop[i]);
      }
    }
  }
  return new Float32Array(out);
}

class Renderer {
  // `body`: places, centre, reach, sides, gradients or null, traces, samples; see main.js.
  constructor(canvas, body) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
    if (!gl) throw new Error("no WebGL 2");
    this.gl = gl;
    this.canvas = canvas;
    this.body = body;
    this.blockProgram = this.program(BLOCK_VERTEX, BLOCK_FRAGMENT);
    this.ribbonProgram = this.program(RIBBON_VERTEX, FLAT_FRAGMENT);
    this.dotProgram = this.program(DOT_VERTEX, DOT_FRAGMENT);
    this.sheetProgram = this.program(SHEET_VERTEX, FLAT_FRAGMENT);
    this.shades = this.texture();
    this.table = this.texture();
    this.sampleTable = this.texture();
    this.makeBlocks();
    this.ribbons = this.makeRibbons(this.body.segments);
    this.cutoffs = this.makeRibbons(this.body.cutoffs);
    this.sheets = this.makeSheets(this.body.sheets);
    this.top = this.makeSheets(this.body.top);
    this.bottom = this.makeSheets(this.body.bottom);
    this.makeDots();
    this.makePicker();
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  program(vertex, fragment) {
    const gl = this.gl;
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
        throw new Error(gl.getShaderInfoLog(shader));
      }
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error(gl.getProgramInfoLog(made));
    }
    const uniforms = new Map();
    made.uniform = (name) => {
      if (!uniforms.has(name)) uniforms.set(name, gl.getUniformLocation(made, name));
      return uniforms.get(name);
    };
    return made;
  }

  texture() {
    const gl = this.gl, made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return made;
  }

  // Fill a texture with records of `size` numbers, four or one to a texel.
  fill(texture, values, size, Kind, inner, format, type) {
    const gl = this.gl;
    const texels = values.length / size, rows = Math.max(1, Math.ceil(texels / WIDE));
    const width = size === 1 ? 1 : 4;
    const padded = new Kind(WIDE * rows * width);
    if (size === width) padded.set(values);
    else {
      for (let k = 0; k < texels; k++) {
        for (let i = 0; i < size; i++) padded[k * width + i] = values[k * size + i];
      }
    }
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, inner, WIDE, rows, 0, format, type, padded);
  }

  makeBlocks() {
    const gl = this.gl, body = this.body;
    this.places = this.texture();
    this.fill(this.places, body.places.values, 3, Uint16Array, gl.RGBA16UI, gl.RGBA_INTEGER,
      gl.UNSIGNED_SHORT);
    this.gradients = this.texture();
    this.fill(this.gradients, body.gradients || new Int16Array(3), 3, Int16Array, gl.RGBA16I,
      gl.RGBA_INTEGER, gl.SHORT);
    this.sizes = this.texture();
    this.fill(this.sizes, body.sizes ? body.sizes.values : new Uint16Array(3), 3, Uint16Array,
      gl.RGBA16UI, gl.RGBA_INTEGER, gl.UNSIGNED_SHORT);
    this.boxes = gl.createVertexArray();
    gl.bindVertexArray(this.boxes);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, boxVertices(), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 20, 0);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 2, gl.FLOAT, false, 20, 12);
    this.ids = gl.createBuffer();
    this.one = gl.createBuffer();
    gl.enableVertexAttribArray(2);
    gl.vertexAttribDivisor(2, 1);
    this.count = 0;
  }

  // Return ribbons along segments, six numbers each: a vertex array and their count.
  makeRibbons(segments) {
    const gl = this.gl, made = { array: null, count: segments ? segments.length / 6 : 0 };
    if (!made.count) return made;
    made.array = gl.createVertexArray();
    gl.bindVertexArray(made.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([0, -0.5, 1, -0.5, 0, 0.5, 1, 0.5]),
      gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 8, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, segments, gl.STATIC_DRAW);
    for (const [slot, from] of [[1, 0], [2, 12]]) {
      gl.enableVertexAttribArray(slot);
      gl.vertexAttribPointer(slot, 3, gl.FLOAT, false, 24, from);
      gl.vertexAttribDivisor(slot, 1);
    }
    return made;
  }

  // Return a surface, given by its places and triangles: a vertex array and its indices' count.
  makeSheets(sheets) {
    const gl = this.gl, made = { array: null, count: sheets ? sheets.triangles.length : 0 };
    if (!made.count) return made;
    made.array = gl.createVertexArray();
    gl.bindVertexArray(made.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, sheets.places, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, sheets.triangles, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return made;
  }

  makeDots() {
    const gl = this.gl, samples = this.body.samples;
    this.sampleCount = samples ? samples.length / 3 : 0;
    if (!this.sampleCount) return;
    this.dots = gl.createVertexArray();
    gl.bindVertexArray(this.dots);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, samples, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
    this.dotShades = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.dotShades);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(this.sampleCount).fill(-2), gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 1, gl.FLOAT, false, 4, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, spread(this.sampleCount), gl.STATIC_DRAW);
    gl.bindVertexArray(null);
  }

  makePicker() {
    const gl = this.gl;
    this.picker = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.picker);
    for (const [format, slot] of [[gl.RGBA8, gl.COLOR_ATTACHMENT0],
      [gl.DEPTH_COMPONENT16, gl.DEPTH_ATTACHMENT]]) {
      const buffer = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, 1, 1);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, slot, gl.RENDERBUFFER, buffer);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  setTable(texture, bytes) {
    const gl = this.gl;
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB8, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, bytes);
  }

  setColours(shades, table) {
    const gl = this.gl;
    this.fill(this.shades, shades, 1, Float32Array, gl.R32F, gl.RED, gl.FLOAT);
    this.setTable(this.table, table);
  }

  setSampleColours(shades, table) {
    if (!this.sampleCount) return;
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.dotShades);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, shades);
    this.setTable(this.sampleTable, table);
  }

  setShown(ids) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.ids);
    gl.bufferData(gl.ARRAY_BUFFER, ids, gl.DYNAMIC_DRAW);
    this.count = ids.length;
  }

  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    return ratio;
  }

  useCamera(program, camera, size) {
    const gl = this.gl, [right, up, back] = camera.axes();
    gl.useProgram(program);
    gl.uniformMatrix3fv(program.uniform("turn"), false, [
      right[0], up[0], back[0], right[1], up[1], back[1],
      ...[right[2], up[2], back[2]].map((x) => x * size.tall)]);
    gl.uniform2f(program.uniform("scale"), ...size.scale);
    gl.uniform2f(program.uniform("shift"), ...size.shift);
    gl.uniform1f(program.uniform("deep"), 1 / (this.body.reach * size.tall));
  }

  // Draw what `look` asks for; `size` holds scale and shift in clip coordinates.
  draw(camera, size, look) {
    const gl = this.gl;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.drawBlocks(camera, size, { mode: 0, edges: look.edges });
    for (const [hidden, alpha] of [[true, 0.28], [false, 1]]) {
      gl.depthFunc(hidden ? gl.GREATER : gl.LEQUAL);
      gl.depthMask(!hidden);
      gl.enable(gl.BLEND);
      if (!hidden && look.horizons) {
        this.drawSheets(this.top, camera, size, look.top, 0.3);
        this.drawSheets(this.bottom, camera, size, look.bottom, 0.3);
      }
      if (look.faults) {
        if (!hidden) this.drawSheets(this.sheets, camera, size, look.fault, 0.18);
        this.drawRibbons(this.cutoffs, camera, size, look.fault, alpha);
      }
      if (look.traces) this.drawRibbons(this.ribbons, camera, size, look.trace, alpha);
      if (look.samples) this.drawDots(camera, size, look.sample, alpha);
      gl.disable(gl.BLEND);
    }
    gl.depthMask(true);
    gl.depthFunc(gl.LESS);
    if (look.picked >= 0) this.drawPicked(camera, size, look);
  }

  drawBlocks(camera, size, how) {
    const gl = this.gl, program = this.blockProgram, body = this.body;
    this.useCamera(program, camera, size);
    gl.enable(gl.CULL_FACE);
    const textures = [this.places, this.gradients, this.shades, this.table, this.sizes];
    textures.forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    });
    gl.activeTexture(gl.TEXTURE0);
    ["places", "gradients", "shades", "table", "sizes"].forEach((name, unit) => {
      gl.uniform1i(program.uniform(name), unit);
    });
    const grow = how.grow || 1;
    gl.uniform3f(program.uniform("origin"), ...body.places.offset.map((x, a) => x - body.centre[a]));
    gl.uniform3f(program.uniform("spacing"), ...body.places.step);
    gl.uniform3f(program.uniform("sides"), ...body.sides);
    gl.uniform1f(program.uniform("grow"), grow * body.grow);
    gl.uniform1i(program.uniform("sized"), body.sizes ? 1 : 0);
    if (body.sizes) {
      gl.uniform3f(program.uniform("smallest"), ...body.sizes.offset);
      gl.uniform3f(program.uniform("sizing"), ...body.sizes.step);
    }
    // Axes stand as columns, row by row: WebGL takes columns one after the other.
    gl.uniformMatrix3fv(program.uniform("axes"), true, body.axes);
    gl.uniform1f(program.uniform("unit"), body.unit);
    gl.uniform1i(program.uniform("bent"), body.gradients ? 1 : 0);
    gl.uniform1i(program.uniform("mode"), how.mode);
    gl.uniform1i(program.uniform("edges"), how.edges ? 1 : 0);
    gl.uniform3f(program.uniform("plain"), ...(how.plain || [0, 0, 0]));
    gl.bindVertexArray(this.boxes);
    gl.bindBuffer(gl.ARRAY_BUFFER, how.only ? this.one : this.ids);
    if (how.only) gl.bufferData(gl.ARRAY_BUFFER, how.only, gl.DYNAMIC_DRAW);
    gl.vertexAttribIPointer(2, 1, gl.UNSIGNED_INT, 4, 0);
    gl.drawArraysInstanced(gl.TRIANGLES, 0, 36, how.only ? how.only.length : this.count);
    gl.disable(gl.CULL_FACE);
  }

  drawRibbons(ribbons, camera, size, colour, alpha) {
    if (!ribbons.count) return;
    const gl = this.gl, program = this.ribbonProgram;
    this.useCamera(program, camera, size);
    gl.uniform2f(program.uniform("pixel"), 2 / this.canvas.width, 2 / this.canvas.height);
    gl.uniform1f(program.uniform("wide"), 2.2 * size.ratio);
    gl.uniform4f(program.uniform("plain"), ...colour, alpha);
    gl.bindVertexArray(ribbons.array);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, ribbons.count);
  }

  // Draw fault surfaces before what lies behind them: translucent, and they hide nothing.
  drawSheets(sheets, camera, size, colour, alpha) {
    if (!sheets.count) return;
    const gl = this.gl;
    this.useCamera(this.sheetProgram, camera, size);
    gl.uniform4f(this.sheetProgram.uniform("plain"), ...colour, alpha);
    gl.depthMask(false);
    gl.bindVertexArray(sheets.array);
    gl.drawElements(gl.TRIANGLES, sheets.count, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
    gl.depthMask(true);
  }

  drawDots(camera, size, colour, alpha) {
    if (!this.sampleCount) return;
    const gl = this.gl, program = this.dotProgram;
    this.useCamera(program, camera, size);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.sampleTable);
    gl.uniform1i(program.uniform("table"), 0);
    const drawn = Math.min(this.sampleCount, FEW_DOTS);
    gl.uniform1f(program.uniform("wide"), (drawn > 500 ? 4.5 : 6.5) * size.ratio);
    gl.uniform4f(program.uniform("plain"), ...colour, alpha);
    gl.bindVertexArray(this.dots);
    gl.drawElements(gl.POINTS, drawn, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
  }

  drawPicked(camera, size, look) {
    const gl = this.gl;
    if (look.picked >= this.body.places.count) return; // a sample: its ring is enough
    gl.disable(gl.DEPTH_TEST);
    const only = new Uint32Array([look.picked]);
    this.drawBlocks(camera, size, { mode: 2, plain: look.pick, only, edges: true, grow: 1.25 });
    gl.enable(gl.DEPTH_TEST);
  }

  // Return which block is seen at a place given in clip coordinates, -1 for none: the block's number
  // is drawn as a colour into a picture of that one pixel.
  pick(camera, size, x, y) {
    const gl = this.gl, w = this.canvas.width, h = this.canvas.height;
    const near = {
      ...size,
      scale: [size.scale[0] * w, size.scale[1] * h],
      shift: [(size.shift[0] - x) * w, (size.shift[1] - y) * h],
    };
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.picker);
    gl.viewport(0, 0, 1, 1);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.drawBlocks(camera, near, { mode: 1 });
    const got = new Uint8Array(4);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, got);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return (got[0] | (got[1] << 8) | (got[2] << 16) | (got[3] << 24)) - 1;
  }
}
