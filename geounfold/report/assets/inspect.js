// What is known of one block or sample, as a list.

class Inspector {
  constructor(model) {
    this.model = model;
    this.place = document.getElementById("facts");
    this.said = document.getElementById("found");
    this.clear = document.getElementById("clear");
    this.row = document.getElementById("row");
  }

  nothing(said) {
    this.place.replaceChildren();
    this.clear.hidden = true;
    this.said.textContent = said || "Click a block, or give its row, to see it in both views.";
  }

  show(picked) {
    const model = this.model, block = picked < model.count;
    const list = element("dl");
    const put = (name, value) => {
      const pair = element("div");
      pair.append(element("dt", name), element("dd", value));
      list.append(pair);
    };
    if (block) {
      this.said.textContent = `Block of data row ${model.rows[picked].toLocaleString("en")}`;
      this.row.value = model.rows[picked];
      this.put(put, "folded", model.folded, picked);
      this.put(put, "unfolded", model.unfolded, picked);
      for (const column of model.columns) put(column.name, valueText(column, picked));
    } else {
      const samples = model.samples, k = picked - model.count;
      const hole = samples.names[samples.hole[k]];
      this.said.textContent = hole ? `Sample of hole ${hole}` : `Sample ${k + 1}`;
      ["folded", "unfolded"].forEach((space) => {
        samples[space].place(k).forEach((x, a) => put(`${space} ${"xyz"[a]}`, written(x)));
      });
      for (const column of samples.columns) put(column.name, valueText(column, k));
    }
    this.place.replaceChildren(list);
    this.clear.hidden = false;
  }

  put(put, name, points, k) {
    const unit = this.model.unit ? ` ${this.model.unit}` : "";
    points.place(k).forEach((x, axis) => {
      put(`${name} ${"xyz"[axis]}`, written(x, points.step[axis]) + unit);
    });
  }
}

function valueText(column, k) {
  const value = column.get(k);
  if (column.kind === "category") return value < 0 ? "no value" : column.categories[value];
  return written(value);
}
