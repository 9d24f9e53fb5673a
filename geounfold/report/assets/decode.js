// Reading the data: base64 of little-endian arrays, as all browsers' machines have them.

const FORMS = {
  u1: Uint8Array, u2: Uint16Array, i2: Int16Array, u4: Uint32Array, f4: Float32Array,
  f8: Float64Array,
};

function bytesOf(text) {
  const raw = atob(text);
  const out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
  return out;
}

function arrayOf(packed) {
  return new FORMS[packed.form](bytesOf(packed.data).buffer);
}

// Points of 16-bit codes or float32: place(k) is [x, y, z] in the data's unit.
function pointsOf(packed) {
  const values = arrayOf(packed);
  const offset = packed.offset;
  const step = packed.step || [1, 1, 1];
  return {
    values, offset, step,
    count: values.length / 3,
    at: (k, axis) => offset[axis] + step[axis] * values[3 * k + axis],
    place: (k) => [0, 1, 2].map((a) => offset[a] + step[a] * values[3 * k + a]),
  };
}

// A column: get(k) is a number, NaN where there is none; of categories the code, -1 for none.
function columnOf(packed) {
  const column = { ...packed };
  delete column.data;
  if (packed.kind === "category") {
    const codes = arrayOf(packed);
    column.get = (k) => (codes[k] === 255 ? -1 : codes[k]);
  } else if (packed.kind === "empty") {
    column.get = () => NaN;
  } else if (packed.form === "constant") {
    column.get = () => packed.range[0];
  } else if (packed.form === "u2") {
    const codes = arrayOf(packed);
    column.get = (k) => (codes[k] === 65535 ? NaN : packed.offset + packed.step * codes[k]);
  } else {
    const values = arrayOf(packed);
    column.get = (k) => packed.offset + values[k];
  }
  return column;
}

function extentOf(points, axis) {
  let low = Infinity, high = -Infinity;
  for (let k = 0; k < points.count; k++) {
    const x = points.at(k, axis);
    if (x < low) low = x;
    if (x > high) high = x;
  }
  return [low, high];
}

// Numbers as people read them: as many digits as the column can tell apart.
function written(value, step) {
  if (!Number.isFinite(value)) return "no value";
  if (step) {
    const digits = Math.min(6, Math.max(0, Math.ceil(-Math.log10(step))));
    return value.toLocaleString("en", {
      minimumFractionDigits: digits, maximumFractionDigits: digits,
    });
  }
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e9 || size < 1e-4)) return value.toExponential(3);
  return value.toLocaleString("en", { maximumSignificantDigits: 6 });
}

function niceTicks(low, high, most) {
  if (!(high > low)) return [low];
  const rough = (high - low) / Math.max(1, most - 1);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((s) => s * power >= rough * (1 - 1e-9));
  const out = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) {
    out.push(Number((k * step).toPrecision(12)));
  }
  return out;
}
