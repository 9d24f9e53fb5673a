// Selects, sliders, theme and copying: everything around the views.

function fillChoices(select, choices, start) {
  const groups = new Map();
  choices.forEach((choice, i) => {
    if (!groups.has(choice.group)) {
      const group = document.createElement("optgroup");
      group.label = choice.group;
      groups.set(choice.group, group);
      select.append(group);
    }
    const option = element("option", titleOf(choice));
    option.value = i;
    groups.get(choice.group).append(option);
  });
  select.value = String(Math.max(0, start));
}

// A slice: hides blocks by one coordinate. `axes` holds, for x, y and the third, the name, the
// coordinate of a block, the extent, and the half thickness of one layer of blocks.
class Slice {
  constructor(root, axes, changed) {
    this.axes = axes;
    this.box = root.querySelector(".slice");
    this.axis = root.querySelector(".axis");
    this.keep = root.querySelector(".keep");
    this.at = root.querySelector(".at");
    this.where = root.querySelector(".where");
    this.changed = changed;
    this.axis.addEventListener("change", () => this.chosen());
    for (const input of [this.keep, this.at]) {
      input.addEventListener("input", () => this.moved());
    }
    axes.forEach((axis, i) => {
      if (!axis) this.axis.querySelector(`option[value="${i}"]`).remove();
    });
    this.moved(true);
  }

  get on() {
    return this.axis.value !== "";
  }

  get current() {
    return this.axes[Number(this.axis.value)];
  }

  // Show the side that lies away from the viewer, so that the cut is seen.
  chosen() {
    if (this.on) this.keep.value = this.current.towards() >= 0 ? "below" : "above";
    this.moved();
  }

  moved(quiet) {
    this.box.classList.toggle("on", this.on);
    for (const input of [this.keep, this.at]) input.disabled = !this.on;
    if (this.on) {
      const axis = this.current;
      const text = `${axis.name} ${written(this.value, axis.step)}${axis.unit}`;
      this.where.textContent = text;
      this.at.setAttribute("aria-valuetext", text);
    } else {
      this.where.textContent = "";
    }
    if (!quiet) this.changed();
  }

  // Let the other view's slice choose the blocks.
  follow() {
    if (!this.on) return;
    this.axis.value = "";
    this.moved(true);
  }

  slide(steps) {
    if (!this.on) return;
    this.at.value = Number(this.at.value) + 20 * steps;
    this.moved();
  }

  get value() {
    const [low, high] = this.current.extent;
    return low + ((high - low) * Number(this.at.value)) / 1000;
  }

  // The coordinate of the block nearest to the slice, so that one layer always has blocks.
  nearest() {
    const { get, count } = this.current, value = this.value;
    let best = value, far = Infinity;
    for (let k = 0; k < count; k++) {
      const off = Math.abs(get(k) - value);
      if (off < far) [best, far] = [get(k), off];
    }
    return best;
  }

  // Return what tells of a block whether it is shown, or null where there is no slice.
  test() {
    if (!this.on) return null;
    const { get, half } = this.current, small = 1e-6 * half;
    const value = this.keep.value === "slab" ? this.nearest() : this.value;
    if (this.keep.value === "below") return (k) => get(k) <= value + small;
    if (this.keep.value === "above") return (k) => get(k) >= value - small;
    return (k) => Math.abs(get(k) - value) <= half;
  }
}

function setUpTheme(changed) {
  const select = document.getElementById("theme");
  select.addEventListener("change", () => {
    if (select.value) document.documentElement.dataset.theme = select.value;
    else delete document.documentElement.dataset.theme;
    changed();
  });
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed);
}

function setUpCopying() {
  for (const button of document.querySelectorAll("button[data-copy]")) {
    button.addEventListener("click", async () => {
      const source = document.getElementById(button.dataset.copy);
      const done = await copied(source);
      button.textContent = done ? "Copied" : "Press Ctrl+C";
      setTimeout(() => { button.textContent = "Copy"; }, 2000);
    });
  }
}

async function copied(source) {
  try {
    await navigator.clipboard.writeText(source.textContent);
    return true;
  } catch {
    const range = document.createRange();
    range.selectNodeContents(source);
    const selection = window.getSelection();
    selection.removeAllRanges();
    selection.addRange(range);
    return document.execCommand("copy");
  }
}

// A colour of the style sheet as parts of 1.
function themeColour(name) {
  const text = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  return hexBytes(text).map((x) => x / 255);
}
