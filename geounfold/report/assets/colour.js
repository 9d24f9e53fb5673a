// From values to colours: which column, which map, which limits; and the legend that says so.

const MISSING = [128, 128, 128];
const BANDS = 8;

function hexBytes(text) {
  return [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16));
}

class Palettes {
  constructor(packed, categories) {
    this.maps = Object.fromEntries(
      Object.entries(packed).map(([name, data]) => [name, bytesOf(data)]));
    this.categories = categories.map(hexBytes);
  }

  // 256 colours of three bytes: a map, in as many steps as there are bands; or categories.
  table(name, bands) {
    const map = this.maps[name];
    if (!bands) return map;
    const out = new Uint8Array(768);
    for (let i = 0; i < 256; i++) {
      const band = Math.min(bands - 1, Math.floor((i / 256) * bands));
      const from = Math.round((255 * band) / (bands - 1));
      out.set(map.subarray(3 * from, 3 * from + 3), 3 * i);
    }
    return out;
  }

  categoryTable(count) {
    const out = new Uint8Array(768);
    for (let i = 0; i < 256; i++) {
      const code = Math.min(count - 1, Math.floor((i / 256) * count));
      out.set(this.category(code), 3 * i);
    }
    return out;
  }

  category(code) {
    return this.categories[code % this.categories.length];
  }
}

// How a column is coloured: shade(value) is -1 (no value) or 0 to 1 along the table.
function scaleOf(column, palettes, chosen, whole) {
  if (column.kind === "category") {
    const n = column.categories.length;
    return {
      column, table: palettes.categoryTable(n),
      shade: (v) => (v < 0 ? -1 : (v + 0.5) / n),
    };
  }
  const name = chosen || column.colours || "viridis";
  let [low, high] = column.limits || [0, 1];
  if (whole && column.range) {
    [low, high] = column.range;
    if (name === "diverging" && column.colours === "diverging") {
      const room = Math.max(Math.abs(low - 1), Math.abs(high - 1), 1e-9);
      [low, high] = [1 - room, 1 + room];
    }
  }
  if (!(high > low)) high = low + 1e-6 * Math.max(1, Math.abs(low));
  return {
    column, low, high, name, bands: column.bands || 0,
    table: palettes.table(name, column.bands),
    shade: (v) => (Number.isFinite(v) ? Math.min(1, Math.max(0, (v - low) / (high - low))) : -1),
  };
}

function rgb(bytes) {
  return `rgb(${bytes[0]}, ${bytes[1]}, ${bytes[2]})`;
}

function element(name, text, className) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
}

function titleOf(column) {
  return column.label && column.label !== column.name
    ? `${column.name}: ${column.label}` : column.name;
}

function showLegend(place, scale, palettes, whole) {
  const column = scale.column;
  place.replaceChildren();
  const head = element("div");
  head.append(element("strong", titleOf(column)));
  if (column.meaning) head.append(element("span", ` ${column.meaning}`, "soft"));
  place.append(head);
  if (column.kind === "category") place.append(swatches(column, palettes));
  else if (column.kind === "empty") place.append(element("p", "No values.", "soft"));
  else place.append(...barOf(scale, whole));
  if (column.missing) {
    const note = element("p", undefined, "soft swatches");
    const box = element("i");
    box.style.background = rgb(MISSING);
    const count = column.missing.toLocaleString("en");
    note.append(box, `${count} without a value`);
    place.append(note);
  }
}

function swatches(column, palettes) {
  const list = element("div", undefined, "swatches");
  const many = column.categories.length;
  const repeated = many > palettes.categories.length ? " (colours repeat)" : "";
  column.categories.slice(0, 24).forEach((name, code) => {
    const item = element("span");
    const box = element("i");
    box.style.background = rgb(palettes.category(code));
    item.append(box, name);
    list.append(item);
  });
  if (many > 24 || repeated) {
    list.append(element("span", `${many} kinds in all${repeated}`, "soft"));
  }
  return list;
}

// Both ends of a range: four significant digits, or more if its span is small beside them.
function ends(low, high) {
  const power = (x) => Math.floor(Math.log10(x));
  const largest = Math.max(Math.abs(low), Math.abs(high));
  const digits = high > low
    ? Math.min(12, Math.max(4, 2 + power(largest) - power(high - low))) : 4;
  const short = (x) => {
    const size = Math.abs(x);
    if (size !== 0 && (size >= 1e9 || size < 1e-4)) return x.toExponential(digits - 1);
    return x.toLocaleString("en", { maximumSignificantDigits: digits });
  };
  return `${short(low)} to ${short(high)}`;
}

function barOf(scale, whole) {
  const bar = element("div", undefined, "bar");
  const stops = [];
  for (let i = 0; i < 64; i++) {
    const colour = rgb(scale.table.subarray(3 * i * 4, 3 * i * 4 + 3));
    stops.push(`${colour} ${(100 * i) / 64}% ${(100 * (i + 1)) / 64}%`);
  }
  bar.style.background = `linear-gradient(to right, ${stops.join(",")})`;
  const ticks = element("div", undefined, "ticks");
  const narrow = window.innerWidth < 700;
  for (const tick of niceTicks(scale.low, scale.high, narrow ? 6 : 9)) {
    const at = (tick - scale.low) / (scale.high - scale.low);
    const mark = element("span", tick.toLocaleString("en", { maximumSignificantDigits: 8 }));
    mark.style.left = `${100 * at}%`;
    if (at < 0.03) mark.style.transform = "none";
    if (at > 0.97) mark.style.transform = "translateX(-100%)";
    ticks.append(mark);
  }
  const [low, high] = scale.column.range;
  const beyond = low < scale.low || high > scale.high;
  let said = `Colours span ${ends(scale.low, scale.high)}; values go from ${ends(low, high)}`;
  if (!whole && beyond) {
    said += scale.column.colours === "diverging"
      ? "; the 1 % farthest from 1 take the end colours"
      : scale.column.clipped === false ? "; those beyond take the end colours"
        : ": the 1st to the 99th percentile, and those beyond take the end colours";
  }
  return [bar, ticks, element("p", `${said}.`, "soft")];
}
