// Where a body is looked at from: parallel projection, turned about the body's middle.

class Camera {
  constructor(azimuth, elevation) {
    this.start = { azimuth, elevation };
    this.reset();
  }

  reset() {
    Object.assign(this, this.start, { zoom: 1, panX: 0, panY: 0 });
  }

  follow(other) {
    for (const key of ["azimuth", "elevation", "zoom", "panX", "panY"]) this[key] = other[key];
  }

  // Unit vectors to the right, up, and towards the viewer.
  axes() {
    const a = (this.azimuth * Math.PI) / 180, e = (this.elevation * Math.PI) / 180;
    const back = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    const right = [-Math.sin(a), Math.cos(a), 0];
    return [right, cross(back, right), back];
  }

  turn(azimuth, elevation) {
    this.azimuth = (this.azimuth + azimuth) % 360;
    this.elevation = Math.min(90, Math.max(-90, this.elevation + elevation));
  }

  // Zoom towards a place, given from the view's middle as parts of its height.
  scale(factor, x, y) {
    const before = this.zoom;
    this.zoom = Math.min(400, Math.max(0.2, this.zoom * factor));
    const by = this.zoom / before;
    this.panX = x + (this.panX - x) * by;
    this.panY = y + (this.panY - y) * by;
  }

  // Move by parts of the view's height.
  pan(x, y) {
    this.panX += x;
    this.panY += y;
  }
}

function cross(a, b) {
  return [
    a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
  ];
}

function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
