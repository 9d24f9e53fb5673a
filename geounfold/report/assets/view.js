// One view of the body: its canvas, what is written over it, pointers and keys.

const TURN = 5; // degrees an arrow key turns
const STEP = 0.06; // part of the height that it moves
const ZOOM = 1.2;

class View {
  // `body` as for Renderer, and name, extent; `watch`: changed, picked, slid, reset, cleared.
  constructor(root, body, start, watch) {
    this.root = root;
    this.body = body;
    this.watch = watch;
    this.canvas = root.querySelector("canvas");
    this.camera = new Camera(start.azimuth, start.elevation);
    this.renderer = new Renderer(this.canvas, body);
    this.ring = root.querySelector(".ring");
    this.triad = root.querySelector(".triad");
    this.scaleText = root.querySelector(".scale span");
    this.scaleBar = root.querySelector(".scale i");
    this.pointers = new Map();
    this.tall = 1; // vertical exaggeration
    this.together = [this];
    this.labels = this.makeLabels();
    this.listen();
  }

  // Pixels per unit of length at zoom 1, at which this view's own body fills it.
  ownFit() {
    const { width, height } = this.canvas, [wide, high] = this.seenSize();
    return 0.9 * Math.min(width / wide, height / high);
  }

  // The same for both views, so that a length is as long in one as in the other.
  fit() {
    return Math.min(...this.together.map((view) => view.ownFit()));
  }

  // Width and height of the body as it is first seen, with the vertical exaggeration.
  seenSize() {
    if (this.tall === 1) return this.body.seen;
    const axes = new Camera(this.camera.start.azimuth, this.camera.start.elevation).axes();
    const half = this.body.extents.map(([a, b], i) => (i === 2 ? this.tall : 1) * (b - a) / 2);
    return [0, 1].map((i) => this.body.size
      + 2 * axes[i].reduce((sum, x, j) => sum + Math.abs(x) * half[j], 0));
  }

  relative(place) {
    return place.map((x, a) => x - this.body.centre[a]);
  }

  size() {
    const { width, height } = this.canvas, zoom = this.fit() * this.camera.zoom;
    return {
      zoom, ratio: this.ratio, tall: this.tall,
      scale: [(2 * zoom) / width, (2 * zoom) / height],
      shift: [2 * this.camera.panX * (height / width), 2 * this.camera.panY],
    };
  }

  // Return where a place is seen: pixels of the page from the view's corner, and its depth.
  seen(place) {
    const [right, up, back] = this.camera.axes(), p = this.relative(place), size = this.size();
    p[2] *= this.tall;
    const x = dot(right, p) * size.scale[0] + size.shift[0];
    const y = dot(up, p) * size.scale[1] + size.shift[1];
    return [
      ((x + 1) / 2) * this.canvas.clientWidth, ((1 - y) / 2) * this.canvas.clientHeight,
      dot(back, p)];
  }

  draw(look) {
    this.ratio = this.renderer.resize();
    this.renderer.draw(this.camera, this.size(), look);
    this.drawRing(look.place);
    this.drawTriad();
    this.drawScale();
    this.drawLabels(look.names);
  }

  // One label at the first known point of each hole.
  makeLabels() {
    const out = [];
    for (const { name, place } of this.body.collars || []) {
      const label = element("span", name);
      label.className = "hole";
      label.hidden = true;
      this.root.querySelector(".port").append(label);
      out.push({ label, place });
    }
    return out;
  }

  // Show the labels that do not cover each other, at most 60.
  drawLabels(wanted) {
    const taken = [];
    for (const { label, place } of this.labels) {
      label.hidden = true;
      if (!wanted || taken.length >= 60) continue;
      const [x, y] = this.seen(place), { clientWidth, clientHeight } = this.canvas;
      if (x < 0 || y < 0 || x > clientWidth - 30 || y > clientHeight) continue;
      const wide = 8 + 7 * label.textContent.length;
      if (taken.some(([a, b, w]) => x < a + w && a < x + wide && Math.abs(y - b) < 15)) continue;
      taken.push([x, y, wide]);
      label.hidden = false;
      label.style.transform = `translate(${(x + 4).toFixed(1)}px, ${(y - 16).toFixed(1)}px)`;
    }
  }

  drawRing(place) {
    const known = place && place.every(Number.isFinite);
    this.ring.hidden = !known;
    if (!known) return;
    const [x, y] = this.seen(place);
    this.ring.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
  }

  drawTriad() {
    const [right, up] = this.camera.axes();
    for (let axis = 0; axis < 3; axis++) {
      const x = 24 * right[axis], y = -24 * up[axis], far = 1.4;
      const [line, name] = this.triad.querySelectorAll(`.ax${axis}`);
      line.setAttribute("x2", x.toFixed(1));
      line.setAttribute("y2", y.toFixed(1));
      name.setAttribute("x", (x * far).toFixed(1));
      name.setAttribute("y", (y * far).toFixed(1));
    }
  }

  drawScale() {
    const perPixel = this.ratio / this.size().zoom; // length per pixel of the page
    const most = 0.3 * this.canvas.clientWidth * perPixel;
    const power = 10 ** Math.floor(Math.log10(most));
    const length = power * [5, 2, 1].find((s) => s * power <= most);
    this.scaleBar.style.width = `${length / perPixel}px`;
    const unit = this.body.unit_name || "units";
    const tall = this.tall === 1 ? "" : `, height × ${this.tall}`;
    this.scaleText.textContent = `${Number(length.toPrecision(3)).toLocaleString("en")} ${unit}${tall}`;
  }

  clip(event) {
    const box = this.canvas.getBoundingClientRect();
    return [
      (2 * (event.clientX - box.left)) / box.width - 1,
      1 - (2 * (event.clientY - box.top)) / box.height];
  }

  pick(x, y) {
    const block = this.renderer.pick(this.camera, this.size(), x, y);
    this.watch.picked(this, block, [
      ((x + 1) / 2) * this.canvas.clientWidth, ((1 - y) / 2) * this.canvas.clientHeight]);
  }

  listen() {
    const c = this.canvas;
    c.addEventListener("pointerdown", (event) => this.press(event));
    c.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel"]) {
      c.addEventListener(end, (event) => this.release(event, end === "pointerup"));
    }
    c.addEventListener("contextmenu", (event) => event.preventDefault());
    c.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    c.addEventListener("keydown", (event) => this.key(event));
  }

  press(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.focus({ preventScroll: true, focusVisible: false });
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    this.travelled = this.pointers.size > 1 ? Infinity : 0;
  }

  move(event) {
    const last = this.pointers.get(event.pointerId);
    if (!last) return;
    const dx = event.clientX - last[0], dy = event.clientY - last[1];
    const height = this.canvas.clientHeight;
    this.travelled += Math.abs(dx) + Math.abs(dy);
    if (this.pointers.size > 1) {
      const [a, b] = [...this.pointers.keys()];
      const other = this.pointers.get(event.pointerId === a ? b : a);
      const before = Math.hypot(last[0] - other[0], last[1] - other[1]);
      const now = Math.hypot(event.clientX - other[0], event.clientY - other[1]);
      if (before > 0 && now > 0) this.camera.scale(now / before, 0, 0);
      this.camera.pan(dx / (2 * height), -dy / (2 * height));
    } else if (event.shiftKey || event.buttons & 6) {
      this.camera.pan(dx / height, -dy / height);
    } else {
      this.camera.turn(-0.4 * dx, 0.4 * dy);
    }
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    this.watch.changed(this);
  }

  release(event, up) {
    if (!this.pointers.delete(event.pointerId)) return;
    if (up && this.travelled < 5 && event.button === 0) this.pick(...this.clip(event));
  }

  wheel(event) {
    if (document.activeElement !== this.canvas && !event.ctrlKey && !event.metaKey) return;
    event.preventDefault();
    const [x, y] = this.clip(event), wide = this.canvas.clientWidth / this.canvas.clientHeight;
    this.camera.scale(Math.exp(-0.0015 * event.deltaY), (x * wide) / 2, y / 2);
    this.watch.changed(this);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrows = {
      ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1],
    };
    const arrow = arrows[event.key];
    if (arrow && event.shiftKey) this.camera.pan(STEP * arrow[0], STEP * arrow[1]);
    else if (arrow) this.camera.turn(-TURN * arrow[0], TURN * arrow[1]);
    else if (event.key === "+" || event.key === "=") this.camera.scale(ZOOM, 0, 0);
    else if (event.key === "-" || event.key === "_") this.camera.scale(1 / ZOOM, 0, 0);
    else if (event.key === "0" || event.key === "Home") this.watch.reset(this);
    else if (event.key === "PageUp") this.watch.slid(this, 1);
    else if (event.key === "PageDown") this.watch.slid(this, -1);
    else if (event.key === "Enter") this.pick(0, 0);
    else if (event.key === "Escape") this.watch.cleared();
    else return;
    event.preventDefault();
    this.watch.changed(this);
  }
}
