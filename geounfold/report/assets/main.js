// The report: reads the data, makes both views, and keeps them together.

const SPACES = ["folded", "unfolded"];

function unable(why) {
  const notice = document.getElementById("unable");
  notice.textContent = `The turning views cannot be shown: ${why}. The still pictures below show `
    + "the same body; everything else on this page is complete.";
  notice.hidden = false;
  document.getElementById("stage").hidden = true;
  const stills = document.getElementById("stills");
  if (stills) stills.open = true;
  document.documentElement.dataset.ready = "without-views";
}

function readModel(data) {
  const blocks = data.blocks;
  const model = {
    count: blocks.count, rows: arrayOf(blocks.rows), outer: arrayOf(blocks.outer),
    folded: pointsOf(blocks.folded), unfolded: pointsOf(blocks.unfolded),
    gradients: arrayOf(blocks.gradients), gradientStep: blocks.gradients.step, bent: blocks.bent,
    sides: blocks.sides, sizes: blocks.sizes && pointsOf(blocks.sizes), axes: blocks.axes,
    grow: blocks.grow, unit: data.unit,
    columns: data.columns.map(columnOf), samples: null, traces: null, faults: null,
    horizons: null,
  };
  if (data.horizons && data.horizons.top) {
    model.horizons = {};
    for (const [name, packed] of Object.entries(data.horizons)) {
      model.horizons[name] = {
        triangles: arrayOf(packed.triangles), folded: pointsOf(packed.folded),
        unfolded: pointsOf(packed.unfolded),
      };
    }
  }
  if (data.faults.triangles) {
    model.faults = {
      vertices: pointsOf(data.faults.vertices), triangles: arrayOf(data.faults.triangles),
      folded: pointsOf(data.faults.folded), unfolded: pointsOf(data.faults.unfolded),
    };
  }
  for (const name of ["traces", "samples"]) {
    const packed = data.holes[name];
    if (!packed) continue;
    model[name] = {
      count: packed.count, names: packed.names, hole: arrayOf(packed.hole),
      folded: pointsOf(packed.folded), unfolded: pointsOf(packed.unfolded),
      columns: packed.columns.map(columnOf),
    };
  }
  return model;
}

// What blocks can be coloured by: layers, the columns, and where they lie.
function choicesOf(model) {
  const height = model.columns.find((c) => c.name === "stratigraphic" && c.kind === "number");
  const out = [];
  if (height) {
    out.push({
      ...height, name: "layers", label: `${BANDS} bands of height`,
      group: "Results", bands: BANDS, clipped: false,
    });
    height.clipped = false;
  }
  out.push(...model.columns);
  for (const space of SPACES) {
    const points = model[space];
    for (let axis = 0; axis < 3; axis++) {
      const extent = extentOf(points, axis);
      out.push({
        name: `${space} ${"xyz"[axis]}`, label: "", group: "Places", kind: "number",
        meaning: model.unit ? `in ${model.unit}` : "in the input's unit",
        colours: "viridis", range: extent, limits: extent, get: (k) => points.at(k, axis),
      });
    }
  }
  return out;
}

// Lines between points that follow each other in one hole, relative to a centre.
function segmentsOf(traces, space, centre) {
  const points = traces[space], out = [];
  for (let k = 1; k < traces.count; k++) {
    if (traces.hole[k] !== traces.hole[k - 1]) continue;
    const a = points.place(k - 1), b = points.place(k);
    if (![...a, ...b].every(Number.isFinite)) continue;
    out.push(...a.map((x, i) => x - centre[i]), ...b.map((x, i) => x - centre[i]));
  }
  return new Float32Array(out);
}

// The first known point of each hole, with the hole's name.
function collarsOf(model, space) {
  const holes = model.traces || model.samples, out = [];
  if (!holes) return out;
  const seen = new Set();
  for (let k = 0; k < holes.count; k++) {
    const hole = holes.hole[k], place = holes[space].place(k);
    if (seen.has(hole) || !holes.names[hole] || !place.every(Number.isFinite)) continue;
    seen.add(hole);
    out.push({ name: holes.names[hole], place });
  }
  return out;
}

// The top and bottom surfaces in a space, relative to a centre.
function horizonsOf(model, space, centre) {
  const out = { top: null, bottom: null };
  for (const name of model.horizons ? ["top", "bottom"] : []) {
    const { triangles, [space]: points } = model.horizons[name];
    out[name] = { places: relativeTo(points, centre), triangles };
  }
  return out;
}

// Places of points one after the other, relative to a centre.
function relativeTo(points, centre) {
  const out = new Float32Array(3 * points.count);
  for (let k = 0; k < points.count; k++) out.set(points.place(k).map((x, a) => x - centre[a]), 3 * k);
  return out;
}

// Return the middle of a body as it is first seen, about which it turns, and its width and height.
function middleOf(places, extents, start, room) {
  const axes = new Camera(start.azimuth, start.elevation).axes();
  const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
  for (let k = 0; k < places.count; k++) {
    const p = places.place(k);
    for (let i = 0; i < 2; i++) {
      const x = dot(axes[i], p);
      if (x < low[i]) low[i] = x;
      if (x > high[i]) high[i] = x;
    }
  }
  const box = extents.map(([a, b]) => (a + b) / 2);
  const along = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, dot(axes[2], box)];
  const centre = [0, 1, 2].map((i) => axes.reduce((sum, axis, j) => sum + axis[i] * along[j], 0));
  return [centre, [high[0] - low[0] + room, high[1] - low[1] + room]];
}

function bodyOf(model, space, start) {
  const places = model[space];
  const extents = [0, 1, 2].map((axis) => extentOf(places, axis));
  const size = Math.hypot(...model.sides);
  const [centre, seen] = middleOf(places, extents, start, size);
  const body = {
    places, extents, centre, seen, size, sides: model.sides, unit: model.gradientStep,
    unit_name: model.unit, gradients: space === model.bent ? model.gradients : null,
    segments: model.traces ? segmentsOf(model.traces, space, centre) : null,
    ...horizonsOf(model, space, centre), collars: collarsOf(model, space),
    samples: null, sizes: model.sizes, axes: model.axes, grow: model.grow,
    cutoffs: model.faults && relativeTo(model.faults[space], centre),
    sheets: model.faults && space === "folded"
      ? { places: relativeTo(model.faults.vertices, centre), triangles: model.faults.triangles }
      : null,
  };
  if (model.samples) {
    body.samples = new Float32Array(3 * model.samples.count);
    for (let k = 0; k < model.samples.count; k++) {
      body.samples.set(model.samples[space].place(k).map((x, a) => x - centre[a]), 3 * k);
    }
  }
  const far = extents.map(([a, b], i) => Math.max(centre[i] - a, b - centre[i]));
  let reach = Math.hypot(...far);
  for (const points of [body.segments, body.samples, body.sheets && body.sheets.places,
    body.top && body.top.places, body.bottom && body.bottom.places]) {
    for (let k = 0; points && k < points.length; k += 3) {
      const length = Math.hypot(points[k], points[k + 1], points[k + 2]);
      if (length > reach) reach = length;
    }
  }
  body.reach = 1.05 * (reach + size);
  return body;
}

class Report {
  constructor(data) {
    this.model = readModel(data);
    this.palettes = new Palettes(data.palettes, data.categories);
    this.choices = choicesOf(this.model);
    this.picked = -1;
    this.byId = (id) => document.getElementById(id);
    this.inspector = new Inspector(this.model);
    const watch = {
      changed: (view) => this.turned(view),
      picked: (view, block, at) => this.pickedIn(view, block, at),
      slid: (view, steps) => this.slices[this.views.indexOf(view)].slide(steps),
      reset: (view) => { view.camera.reset(); },
      cleared: () => this.pick(-1),
    };
    this.byId("stage").hidden = false;
    this.views = SPACES.map((space) => new View(
      this.byId(space), bodyOf(this.model, space, data.view), data.view, watch));
    this.slices = SPACES.map((space, i) => new Slice(
      this.byId(space), this.sliceAxes(space, this.views[i]), () => this.sliced(i)));
    for (const view of this.views) view.together = this.views;
    this.describe();
    this.setUp(data.start);
    this.colour();
    this.colourSamples();
    this.sliced();
  }

  sliceAxes(space, view) {
    const points = this.model[space], body = view.body, sides = this.model.sides;
    const unit = this.model.unit ? ` ${this.model.unit}` : "";
    const wide = space === this.model.bent
      ? sides.map(() => Math.cbrt(sides[0] * sides[1] * sides[2])) : sides;
    const towards = (axis) => () => view.camera.axes()[2][axis];
    const axes = [0, 1, 2].map((axis) => ({
      name: "xyz"[axis], get: (k) => points.at(k, axis), extent: body.extents[axis],
      half: 0.51 * wide[axis], step: points.step[axis], unit, towards: towards(axis),
      count: this.model.count,
    }));
    if (space === "unfolded") {
      const height = this.model.columns.find((c) => c.name === "stratigraphic" && c.range);
      const thick = body.extents[2][1] - body.extents[2][0];
      axes[2] = height && {
        name: "height", get: height.get, extent: height.range, step: 0.01, unit: "",
        half: (0.51 * wide[2] * (height.range[1] - height.range[0])) / Math.max(thick, wide[2]),
        towards: towards(2), count: this.model.count,
      };
    }
    return axes;
  }

  describe() {
    this.views.forEach((view) => {
      const text = view.body.extents.map(([low, high]) => written(
        Number((high - low).toPrecision(4)))).join(" × ");
      view.root.querySelector(".extent").textContent = `${text} ${this.model.unit || "units"}`;
    });
  }

  setUp(start) {
    fillChoices(this.byId("colour"), this.choices, this.choices.findIndex((c) => c.name === start));
    for (const id of ["colour", "palette", "range"]) {
      this.byId(id).addEventListener("change", () => { this.colour(); this.draw(); });
    }
    this.setUpSamples();
    for (const id of ["edges", "traces", "samples", "faults", "horizons", "names"]) {
      this.byId(id).addEventListener("change", () => this.draw());
    }
    this.byId("tall").addEventListener("change", () => {
      for (const view of this.views) view.tall = Number(this.byId("tall").value);
      this.draw();
    });
    this.byId("picture").addEventListener("click", () => this.savePicture());
    this.byId("linked").addEventListener("change", () => this.turned(this.views[0]));
    for (const button of document.querySelectorAll("button[data-view]")) {
      button.addEventListener("click", () => this.lookFrom(button.dataset.view));
    }
    this.byId("find").addEventListener("submit", (event) => {
      event.preventDefault();
      this.find(Number(this.byId("row").value));
    });
    this.byId("clear").addEventListener("click", () => this.pick(-1));
    new ResizeObserver(() => this.draw()).observe(document.querySelector(".views"));
    for (const view of this.views) {
      view.canvas.addEventListener("webglcontextlost", (event) => {
        event.preventDefault();
        unable("the graphics card gave up; loading the page again may help");
      });
    }
  }

  setUpSamples() {
    const samples = this.model.samples, select = this.byId("sample-colour");
    this.byId("samples").closest("label").hidden = !samples;
    this.byId("traces").closest("label").hidden = !this.model.traces;
    this.byId("faults").closest("label").hidden = !this.model.faults;
    this.byId("horizons").closest("label").hidden = !this.model.horizons;
    this.byId("names").closest("label").hidden = !this.views[0].labels.length;
    if (samples && samples.count > FEW_DOTS) {
      this.byId("thinned").textContent = ` (${FEW_DOTS.toLocaleString("en")} of `
        + `${samples.count.toLocaleString("en")})`;
    }
    select.closest("label").hidden = !samples || !samples.columns.length;
    if (!samples) return;
    const plain = { name: "one colour", label: "", group: "None", kind: "plain" };
    this.sampleChoices = [plain, ...samples.columns];
    fillChoices(select, this.sampleChoices, 0);
    select.addEventListener("change", () => { this.colourSamples(); this.draw(); });
  }

  colour() {
    const column = this.choices[Number(this.byId("colour").value)];
    const whole = this.byId("range").value === "range";
    const scale = scaleOf(column, this.palettes, this.byId("palette").value, whole);
    for (const id of ["palette", "range"]) this.byId(id).disabled = column.kind !== "number";
    const shades = new Float32Array(this.model.count);
    for (let k = 0; k < shades.length; k++) shades[k] = scale.shade(column.get(k));
    for (const view of this.views) view.renderer.setColours(shades, scale.table);
    showLegend(this.byId("legend"), scale, this.palettes, whole);
  }

  colourSamples() {
    const samples = this.model.samples, legend = this.byId("sample-legend");
    if (!samples) return;
    const column = this.sampleChoices[Number(this.byId("sample-colour").value)];
    const shades = new Float32Array(samples.count).fill(-2);
    let table = this.palettes.table("cividis", 0);
    legend.hidden = column.kind === "plain";
    if (column.kind !== "plain") {
      const scale = scaleOf(column, this.palettes, "", false);
      for (let k = 0; k < shades.length; k++) shades[k] = scale.shade(column.get(k));
      table = scale.table;
      showLegend(legend, scale, this.palettes, false);
    }
    for (const view of this.views) view.renderer.setSampleColours(shades, table);
  }

  // Show the same blocks in both views: those of the slice, or without one the outer blocks. The
  // slice set last leads and the other view follows it, so the two never hide everything.
  sliced(leading) {
    if (leading !== undefined && this.slices[leading].on) this.slices[1 - leading].follow();
    const tests = this.slices.map((slice) => slice.test()).filter(Boolean);
    const ids = new Uint32Array(this.model.count);
    let count = 0;
    for (let k = 0; k < ids.length; k++) {
      if (tests.length ? tests.every((test) => test(k)) : this.model.outer[k]) ids[count++] = k;
    }
    const shown = ids.subarray(0, count);
    for (const view of this.views) view.renderer.setShown(shown);
    const all = this.model.count.toLocaleString("en"), some = count.toLocaleString("en");
    this.byId("shown").textContent = tests.length
      ? `${some} of ${all} blocks shown, the same in both views.`
      : `${some} outer blocks of ${all} shown; slices show the inside.`;
    this.draw();
  }

  turned(view) {
    if (this.byId("linked").checked) {
      for (const other of this.views) if (other !== view) other.camera.follow(view.camera);
    }
    this.draw();
  }

  lookFrom(name) {
    const angles = { above: [-90, 90], y: [-90, 0], x: [180, 0] }[name];
    const to = angles || [this.views[0].camera.start.azimuth, this.views[0].camera.start.elevation];
    const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    const from = this.views.map(({ camera }) => [camera.azimuth, camera.elevation]);
    const begin = performance.now();
    if (!angles) this.views.forEach(({ camera }) => camera.reset());
    const step = (now) => {
      const t = still ? 1 : Math.min(1, Math.max(0, (now - begin) / 350)), s = t * t * (3 - 2 * t);
      this.views.forEach(({ camera }, i) => {
        const round = ((to[0] - from[i][0] + 540) % 360) - 180;
        camera.azimuth = t === 1 ? to[0] : from[i][0] + s * round;
        camera.elevation = t === 1 ? to[1] : from[i][1] + s * (to[1] - from[i][1]);
      });
      this.draw();
      if (t < 1) requestAnimationFrame(step);
    };
    step(begin);
  }

  pickedIn(view, block, at) {
    const sample = this.sampleNear(view, block, at);
    this.pick(sample >= 0 ? this.model.count + sample : block);
  }

  // Return the sample at a place of a view, unless the block seen there lies before it; or -1.
  sampleNear(view, block, [x, y]) {
    const samples = this.model.samples;
    if (!samples || !this.byId("samples").checked) return -1;
    const space = SPACES[this.views.indexOf(view)];
    const front = block < 0 ? -Infinity
      : view.seen(this.model[space].place(block))[2] - view.body.size / 2;
    let best = -1, near = 7;
    for (let k = 0; k < samples.count; k++) {
      const [sx, sy, depth] = view.seen(samples[space].place(k));
      const far = Math.hypot(sx - x, sy - y);
      if (far < near && depth > front) [best, near] = [k, far];
    }
    return best;
  }

  find(row) {
    const k = this.model.rows.indexOf(row);
    this.pick(k);
    if (k < 0) {
      this.inspector.nothing(`Row ${row} is not drawn: the table has no such row, or the block was `
        + "left out.");
    }
  }

  pick(k) {
    this.picked = k;
    if (k < 0) this.inspector.nothing();
    else this.inspector.show(k);
    this.draw();
  }

  placeOf(k, space) {
    if (k < 0) return null;
    const { count, samples } = this.model;
    return k < count ? this.model[space].place(k) : samples[space].place(k - count);
  }

  // Save both views side by side, with their titles and scales, as a PNG.
  savePicture() {
    this.drawNow();
    const [first, second] = this.views.map((view) => view.canvas);
    const gap = 12, head = 34, foot = 30, ratio = this.views[0].ratio || 1;
    const picture = element("canvas");
    picture.width = first.width + second.width + gap * ratio;
    picture.height = Math.max(first.height, second.height) + (head + foot) * ratio;
    const pen = picture.getContext("2d");
    const [paper, ink] = ["--port", "--ink"].map((name) =>
      getComputedStyle(document.documentElement).getPropertyValue(name).trim());
    pen.fillStyle = paper;
    pen.fillRect(0, 0, picture.width, picture.height);
    pen.fillStyle = ink;
    this.views.forEach((view, i) => {
      const left = i * (first.width + gap * ratio), low = head * ratio + view.canvas.height;
      pen.drawImage(view.canvas, left, head * ratio);
      pen.font = `${16 * ratio}px sans-serif`;
      pen.fillText(view.root.querySelector("h3").textContent.trim(), left + 8 * ratio, 22 * ratio);
      const wide = parseFloat(view.scaleBar.style.width) * ratio, right = left + view.canvas.width;
      pen.font = `${13 * ratio}px sans-serif`;
      pen.fillRect(right - wide - 10 * ratio, low + 6 * ratio, wide, 3 * ratio);
      pen.fillText(view.scaleText.textContent, right - wide - 10 * ratio, low + 25 * ratio);
    });
    const link = element("a");
    link.download = "unfolding.png";
    link.href = picture.toDataURL("image/png");
    link.click();
  }

  // Draw once before the screen is next shown, however often it was asked for.
  draw() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.drawNow();
    });
  }

  drawNow() {
    const look = {
      edges: this.byId("edges").checked, traces: this.byId("traces").checked,
      samples: this.byId("samples").checked, faults: this.byId("faults").checked,
      horizons: this.byId("horizons").checked, names: this.byId("names").checked,
      top: [0.84, 0.37, 0], bottom: [0, 0.45, 0.7],
      fault: themeColour("--fault"), picked: this.picked,
      trace: themeColour("--trace"), pick: themeColour("--pick"), sample: [0.9, 0.62, 0],
    };
    this.views.forEach((view, i) => {
      view.draw({ ...look, place: this.placeOf(this.picked, SPACES[i]) });
    });
    document.documentElement.dataset.ready = "true";
  }
}

let report = null;
setUpTheme(() => report && report.draw());
setUpCopying();
window.addEventListener("beforeprint", () => {
  const stills = document.getElementById("stills");
  if (stills) stills.open = true;
});
try {
  report = new Report(JSON.parse(document.getElementById("data").textContent));
} catch (error) {
  unable(error.message === "no WebGL 2" ? "this browser offers no WebGL 2" : String(error.message));
}
