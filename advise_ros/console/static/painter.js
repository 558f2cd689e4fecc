// Draws one map: cells, walls, waypoints, the question, arrows, routes, the drone. Knows no page and no state.
import { STEP } from '/console/words.js';

const LIGHT = {
  paper: '#ffffff', line: '#d5dce2', ink: '#16202a', wall: '#3c4650', asked: '#A86A00', askedFill: '#fde7b5', flown: '#0072B2',
  policy: '#16202a', route: '#5b6875', axis: '#55626f', change: '#00754f', changeFill: '#c9efe0', clash: '#b8330f', drone: '#8a1c6a',
  heat: [[255, 255, 255], [120, 94, 180]], part: '#0072B2', keepOut: '#d1462f', disputed: '#A31F00', keep: '#5b2fb0', through: '#855400',
};
const DARK = {
  paper: '#141b22', line: '#33404c', ink: '#f2f5f7', wall: '#8793a0', asked: '#F5B82E', askedFill: '#5a4308', flown: '#56B4E9',
  policy: '#f2f5f7', route: '#9aa8b5', axis: '#a5b2be', change: '#35d39a', changeFill: '#0d4a37', clash: '#ff8a5c', drone: '#ff8ad8',
  heat: [[20, 27, 34], [150, 120, 220]], part: '#56B4E9', keepOut: '#e0573c', disputed: '#ff9a7a', keep: '#bda2ff', through: '#F5B82E',
};
const LEVELS = 35, TRACK_PARTS = 6, CELL_MOST = 150;
// Room [css px] around a map, and for the numbers of its columns and rows: left, below.
const EDGE = 4, AXES = [26, 20];
// Per cent below which a cell is as good as free.
const KEEP_OUT_LEAST = 5;

export class Painter {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d');
  }

  // Where the whole map lies in a box: {cell, x, y} [css px].
  whole(map, width, height, axes) {
    const [left, bottom] = axes ? AXES : [EDGE, EDGE], across = width - left - EDGE, up = height - EDGE - bottom;
    const cell = Math.max(1.5, Math.min(across / map.width, up / map.height, CELL_MOST));
    return { cell, x: left + Math.max(0, (across - cell * map.width) / 2), y: EDGE + Math.max(0, (up - cell * map.height) / 2) };
  }

  // Prepare the canvas for a box of `width` x `height` css pixels; `section` is what is seen of the map, null: all of it.
  fit(map, width, height, { dark, section = null, axes = false }) {
    const ratio = window.devicePixelRatio || 1, [left, bottom] = axes ? AXES : [EDGE, EDGE];
    this.colours = dark ? DARK : LIGHT;
    this.map = map;
    this.axes = axes;
    this.box = { left, top: EDGE, right: width - EDGE, bottom: height - bottom };
    const seen = section || this.whole(map, width, height, axes);
    this.cell = seen.cell;
    this.unit = Math.min(this.cell, 84); // Marks do not grow with very large cells.
    this.x = this.inside(seen.x, this.cell * map.width, this.box.left, this.box.right);
    this.y = this.inside(seen.y, this.cell * map.height, this.box.top, this.box.bottom);
    if (section) Object.assign(section, { x: this.x, y: this.y });
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.canvas.style.width = `${width}px`;
    this.canvas.style.height = `${height}px`;
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  // The map's edge, so that no empty place is seen beside a map that is larger than the box.
  inside(at, size, low, high) { return size <= high - low ? low + (high - low - size) / 2 : Math.min(low, Math.max(high - size, at)); }

  left(cell) { return this.x + (cell % this.map.width) * this.cell; }
  top(cell) { return this.y + (this.map.height - 1 - Math.floor(cell / this.map.width)) * this.cell; }
  centre(cell) { return [this.left(cell) + this.cell / 2, this.top(cell) + this.cell / 2]; }
  sees(cell) {
    const x = this.left(cell), y = this.top(cell);
    return x < this.box.right && x + this.cell > this.box.left && y < this.box.bottom && y + this.cell > this.box.top;
  }
  clipped(draw) {
    const { context, box } = this;
    context.save();
    context.beginPath();
    context.rect(box.left - 1, box.top - 1, box.right - box.left + 2, box.bottom - box.top + 2);
    context.clip();
    draw();
    context.restore();
  }
  at(east, north) {
    const x = (east - this.map.origin[0]) / this.map.resolution, y = (north - this.map.origin[1]) / this.map.resolution;
    return [this.x + x * this.cell, this.y + (this.map.height - y) * this.cell];
  }
  cellAt(x, y) {
    const column = Math.floor((x - this.x) / this.cell), row = this.map.height - 1 - Math.floor((y - this.y) / this.cell);
    return column >= 0 && column < this.map.width && row >= 0 && row < this.map.height ? row * this.map.width + column : -1;
  }

  // view: {layer, asked, lit, disputed, keepOut, flown, greedy, unsure, changes, part, clash, routes, next, show, small}
  base(view) {
    this.context.fillStyle = this.colours.paper;
    this.context.fillRect(0, 0, this.canvas.width, this.canvas.height);
    this.clipped(() => this.cells(view));
    if (this.axes) this.numbers();
  }

  // Columns from the west and rows from the south, counted from 1; as many as there is room for.
  numbers() {
    const { context, map, box } = this, step = [1, 2, 5, 10, 20, 50, 100].find((one) => one * this.cell >= 24) || 100;
    context.fillStyle = this.colours.axis;
    context.font = '600 12px system-ui, sans-serif';
    const shown = (index) => step === 1 || (index + 1) % step === 0;
    context.textBaseline = 'top';
    context.textAlign = 'center';
    const below = Math.min(box.bottom, this.y + map.height * this.cell) + 4, beside = Math.max(box.left, this.x) - 5;
    for (let column = 0; column < map.width; column++) {
      const x = this.x + (column + 0.5) * this.cell;
      if (shown(column) && x > box.left && x < box.right) context.fillText(String(column + 1), x, below);
    }
    context.textBaseline = 'middle';
    context.textAlign = 'right';
    for (let row = 0; row < map.height; row++) {
      const y = this.y + (map.height - row - 0.5) * this.cell;
      if (shown(row) && y > box.top && y < box.bottom) context.fillText(String(row + 1), beside, y);
    }
  }

  cells(view) {
    const { map, colours } = this;
    if (view.show.unsure && view.unsure) this.heat(view);
    else if (view.lit) this.fillCells(view.asked, colours.askedFill);
    if (view.keepOut && !view.show.unsure) this.keepOut(view.keepOut);
    this.fillCells(new Set(view.changes.keys()), colours.changeFill);
    this.lines();
    if (view.lit) this.outline(view.asked, colours.asked, this.cell > 12 ? 3 : 2);
    this.outline(view.disputed, colours.disputed, this.cell > 12 ? 4 : 2.5);
    if (view.part.size) this.hatch(view.part, colours.part);
    if (view.clash.size) this.hatch(view.clash, colours.clash, true);
    this.walls(map.blocked);
    for (const route of view.routes) this.route(route);
    if (view.show.flown && view.flown) this.flownArrows(view);
    if (view.show.policy && view.greedy) this.policyArrows(view);
    if (view.keepOut && !view.show.unsure) this.perCents(view.keepOut);
    this.question(view.disputed);
    this.waypoints(view.next, view.small);
  }

  // The stronger, the likelier to be kept out of.
  keepOut(shares) {
    const { context, colours } = this;
    for (let cell = 0; cell < shares.length; cell++) {
      if (shares[cell] < KEEP_OUT_LEAST) continue;
      context.globalAlpha = 0.1 + 0.5 * shares[cell] / 100;
      context.fillStyle = colours.keepOut;
      context.fillRect(this.left(cell), this.top(cell), this.cell, this.cell);
      context.globalAlpha = 1;
    }
  }

  // The same in per cent, above all arrows, where there is room.
  perCents(shares) {
    const { context, colours } = this;
    if (this.cell < 30) return;
    context.font = `600 ${Math.round(Math.min(13, 0.26 * this.cell))}px system-ui, sans-serif`;
    context.textAlign = 'right';
    context.textBaseline = 'bottom';
    context.lineWidth = 3;
    for (let cell = 0; cell < shares.length; cell++) {
      if (shares[cell] < KEEP_OUT_LEAST) continue;
      const [text, x, y] = [`${shares[cell]}`, this.left(cell) + this.cell - 3, this.top(cell) + this.cell - 2];
      context.strokeStyle = colours.paper;
      context.strokeText(text, x, y);
      context.fillStyle = colours.ink;
      context.fillText(text, x, y);
    }
  }

  // A question mark in the corner of each cell in dispute.
  question(cells) {
    const { context, colours } = this, size = Math.round(Math.max(9, Math.min(0.34 * this.cell, 22)));
    if (this.cell < 12) return;
    context.fillStyle = colours.disputed;
    context.font = `800 ${size}px system-ui, sans-serif`;
    context.textAlign = 'right';
    context.textBaseline = 'top';
    for (const cell of cells) context.fillText('?', this.left(cell) + this.cell - 4, this.top(cell) + 3);
  }

  heat(view) {
    const [low, high] = this.colours.heat;
    const palette = Array.from({ length: LEVELS + 1 }, (_, level) =>
      `rgb(${low.map((from, i) => Math.round(from + (0.85 * level / LEVELS) * (high[i] - from))).join()})`);
    for (let cell = 0; cell < view.unsure.length; cell++) {
      this.context.fillStyle = palette[parseInt(view.unsure[cell], 36)];
      this.context.fillRect(this.left(cell), this.top(cell), this.cell + 0.5, this.cell + 0.5);
    }
  }

  fillCells(cells, colour) {
    this.context.fillStyle = colour;
    for (const cell of cells) this.context.fillRect(this.left(cell), this.top(cell), this.cell, this.cell);
  }

  lines() {
    const { context, map } = this;
    if (this.cell < 5) return;
    context.strokeStyle = this.colours.line;
    context.lineWidth = 1;
    context.beginPath();
    const [right, bottom] = [this.x + map.width * this.cell, this.y + map.height * this.cell];
    for (let x = 0; x <= map.width; x++) { context.moveTo(this.x + x * this.cell, this.y); context.lineTo(this.x + x * this.cell, bottom); }
    for (let y = 0; y <= map.height; y++) { context.moveTo(this.x, this.y + y * this.cell); context.lineTo(right, this.y + y * this.cell); }
    context.stroke();
  }

  // The border around a set of cells, so that a cluster reads as one area.
  outline(cells, colour, width) {
    const { context, map } = this;
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.lineCap = 'square';
    context.beginPath();
    for (const cell of cells) {
      const x = this.left(cell), y = this.top(cell), s = this.cell, column = cell % map.width;
      if (!cells.has(cell + map.width)) { context.moveTo(x, y); context.lineTo(x + s, y); }
      if (!cells.has(cell - map.width)) { context.moveTo(x, y + s); context.lineTo(x + s, y + s); }
      if (column === 0 || !cells.has(cell - 1)) { context.moveTo(x, y); context.lineTo(x, y + s); }
      if (column === map.width - 1 || !cells.has(cell + 1)) { context.moveTo(x + s, y); context.lineTo(x + s, y + s); }
    }
    context.stroke();
  }

  // Strokes from the lower left to the upper right, each within its cell; crossed ones go the other way too.
  hatch(cells, colour, crossed = false) {
    const { context } = this, s = this.cell;
    context.strokeStyle = colour;
    context.lineWidth = Math.min(4, Math.max(1.5, s / 18));
    context.lineCap = 'butt';
    context.beginPath();
    for (const cell of cells) {
      const x = this.left(cell), y = this.top(cell);
      for (const share of [0.25, 0.5, 0.75, 1]) {
        context.moveTo(x + share * s, y); context.lineTo(x, y + share * s);
        if (share < 1) { context.moveTo(x + s, y + share * s); context.lineTo(x + share * s, y + s); }
        if (crossed) { context.moveTo(x + (1 - share) * s, y); context.lineTo(x + s, y + share * s); }
        if (crossed && share < 1) { context.moveTo(x, y + share * s); context.lineTo(x + (1 - share) * s, y + s); }
      }
    }
    context.stroke();
  }

  walls(blocked) {
    const { context } = this, s = this.cell;
    for (const cell of blocked) {
      const x = this.left(cell), y = this.top(cell);
      context.fillStyle = this.colours.wall;
      context.fillRect(x, y, s, s);
      if (s < 10) continue;
      context.strokeStyle = this.colours.paper;
      context.lineWidth = 1.5;
      context.beginPath();
      context.moveTo(x + 0.25 * s, y + 0.25 * s); context.lineTo(x + 0.75 * s, y + 0.75 * s);
      context.moveTo(x + 0.75 * s, y + 0.25 * s); context.lineTo(x + 0.25 * s, y + 0.75 * s);
      context.stroke();
    }
  }

  // A triangle in the middle of each cell: where the drone would fly. Changed ones are larger, with an outline.
  policyArrows(view) {
    const { map, colours } = this, walls = new Set(map.blocked);
    for (let cell = 0; cell < view.greedy.length; cell++) {
      if (walls.has(cell) || view.final === cell || view.changes.has(cell) || !this.sees(cell)) continue;
      const inside = view.asked.has(cell);
      this.triangle(cell, Number(view.greedy[cell]), inside ? 0.17 : 0.12, inside ? colours.policy : colours.route);
    }
    for (const [cell, action] of view.changes) this.triangle(cell, action, 0.22, colours.change);
  }

  triangle(cell, action, size, colour) {
    const { context } = this, [x, y] = this.centre(cell), s = Math.max(1.6, size * this.unit);
    const [dx, dy] = [STEP[action][0], -STEP[action][1]];
    context.fillStyle = colour;
    context.beginPath();
    context.moveTo(x + 1.1 * s * dx, y + 1.1 * s * dy);
    context.lineTo(x - 0.7 * s * dx - 0.9 * s * dy, y - 0.7 * s * dy + 0.9 * s * dx);
    context.lineTo(x - 0.7 * s * dx + 0.9 * s * dy, y - 0.7 * s * dy - 0.9 * s * dx);
    context.fill();
  }

  // Line arrows from the middle outwards, the longer and thicker, the more often that direction was flown.
  flownArrows(view) {
    const { context } = this;
    context.strokeStyle = this.colours.flown;
    context.lineCap = 'butt';
    for (const [cell, taken] of view.flown) {
      if (!this.sees(cell)) continue;
      const total = taken[0] + taken[1] + taken[2] + taken[3], [x, y] = this.centre(cell);
      for (let action = 0; action < 4; action++) {
        if (!taken[action]) continue;
        const [dx, dy] = [STEP[action][0], -STEP[action][1]], share = taken[action] / total;
        const from = 0.24 * this.unit, to = from + (0.1 + 0.14 * share) * this.unit, head = (0.05 + 0.04 * share) * this.unit;
        context.lineWidth = Math.max(1, (0.02 + 0.045 * share) * this.unit);
        context.beginPath();
        context.moveTo(x + from * dx, y + from * dy);
        context.lineTo(x + to * dx, y + to * dy);
        if (this.cell > 14) {
          context.moveTo(x + (to - head) * dx - head * dy, y + (to - head) * dy - head * dx);
          context.lineTo(x + to * dx, y + to * dy);
          context.lineTo(x + (to - head) * dx + head * dy, y + (to - head) * dy + head * dx);
        }
        context.stroke();
      }
    }
  }

  // route: {cells, dashed, colour: name, stuck, width, shift}
  route(route) {
    const { context } = this;
    if (!route.cells.length) return;
    const shift = (route.shift || 0) * this.cell;
    context.strokeStyle = this.colours[route.colour];
    context.lineWidth = Math.max(1.5, (route.width || 0.06) * this.unit);
    context.lineJoin = context.lineCap = 'round';
    context.setLineDash(route.dashed ? [0.12 * this.unit, 0.16 * this.unit] : []);
    context.beginPath();
    route.cells.forEach((cell, index) => {
      const [x, y] = this.centre(cell);
      if (index) context.lineTo(x + shift, y + shift); else context.moveTo(x + shift, y + shift);
    });
    context.stroke();
    context.setLineDash([]);
    if (route.stuck) this.cross(this.centre(route.cells[route.cells.length - 1]), this.colours.clash, 0.16 * this.unit, 0.3 * this.cell);
  }

  // Where a route goes on no more: a cross in the corner, where no arrow is.
  cross([middleX, middleY], colour, size, shift) {
    const { context } = this, x = middleX + shift, y = middleY + shift;
    const width = Math.max(2, size / 2.5);
    for (const [style, line] of [[this.colours.paper, 2.4 * width], [colour, width]]) { // An edge, so that it is told from a hatch.
      context.strokeStyle = style;
      context.lineWidth = line;
      context.beginPath();
      context.moveTo(x - size, y - size); context.lineTo(x + size, y + size);
      context.moveTo(x + size, y - size); context.lineTo(x - size, y + size);
      context.stroke();
    }
  }

  waypoints(next, small) {
    const { context, map, colours } = this;
    // In the corner of its cell, where no arrow is.
    const radius = Math.max(small ? 6 : 7, Math.min(0.16 * this.cell, 15)), inset = Math.min(0.2 * this.cell, radius + 3);
    map.waypoints.forEach((cell, index) => {
      // A sign that is larger than its cell stays on the map.
      const within = (at, low, size) => Math.min(Math.max(at, low + radius + 1), low + size - radius - 1), ahead = index === next;
      const x = within(this.left(cell) + Math.max(inset, radius * 0.7), this.x, map.width * this.cell);
      const y = within(this.top(cell) + Math.max(inset, radius * 0.7), this.y, map.height * this.cell);
      context.fillStyle = ahead ? colours.ink : colours.paper;
      context.strokeStyle = colours.ink;
      context.lineWidth = ahead ? 2 : 1.2;
      context.beginPath();
      context.arc(x, y, radius, 0, 2 * Math.PI);
      context.fill();
      context.stroke();
      context.fillStyle = ahead ? colours.paper : colours.ink;
      context.font = `700 ${Math.round(1.25 * radius)}px system-ui, sans-serif`;
      context.textAlign = 'center';
      context.textBaseline = 'middle';
      context.fillText(String(index + 1), x, y + 0.5);
    });
  }

  // view: {drone, track, cursor, moment}
  over(view) {
    const { context } = this;
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.clipped(() => this.moves(view));
  }

  moves(view) {
    const { context, colours } = this;
    if (view.track.length > 1) this.track(view.track);
    if (view.moment) this.moment(view.moment);
    if (view.cursor >= 0) {
      context.strokeStyle = colours.part;
      context.lineWidth = 4;
      context.strokeRect(this.left(view.cursor) + 3, this.top(view.cursor) + 3, this.cell - 6, this.cell - 6);
    }
    if (view.drone) this.drone(view.drone);
  }

  // The older, the fainter.
  track(points) {
    const { context } = this, drawn = points.map(([east, north]) => this.at(east, north));
    context.strokeStyle = this.colours.drone;
    context.lineWidth = 2;
    for (let part = 0; part < TRACK_PARTS; part++) {
      const from = Math.floor(part * drawn.length / TRACK_PARTS), to = Math.floor((part + 1) * drawn.length / TRACK_PARTS);
      context.globalAlpha = 0.6 * (part + 1) / TRACK_PARTS;
      context.beginPath();
      drawn.slice(Math.max(0, from - 1), to).forEach(([x, y], index) => (index ? context.lineTo(x, y) : context.moveTo(x, y)));
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  // A flown moment: the way so far as a line, the place now as a disc.
  moment({ cells, done }) {
    const { context, colours } = this, whole = Math.min(Math.floor(done), cells.length - 1), share = done - whole;
    const points = cells.slice(0, whole + 1).map((cell) => this.centre(cell));
    if (whole < cells.length - 1) {
      const [a, b] = [points[whole], this.centre(cells[whole + 1])];
      points.push([a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]);
    }
    context.strokeStyle = context.fillStyle = colours.flown;
    context.lineWidth = Math.max(3, 0.12 * this.cell);
    context.lineJoin = context.lineCap = 'round';
    context.beginPath();
    points.forEach(([x, y], index) => (index ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.stroke();
    const [x, y] = points[points.length - 1];
    context.beginPath();
    context.arc(x, y, Math.max(5, 0.16 * this.cell), 0, 2 * Math.PI);
    context.fill();
  }

  // Four rotors and a nose, so that it is told from every other mark by its shape.
  drone([east, north, , yaw]) {
    const { context, colours } = this, [x, y] = this.at(east, north), size = Math.max(9, Math.min(0.28 * this.cell, 22));
    context.save();
    context.translate(x, y);
    context.rotate(-yaw);
    context.lineWidth = 2;
    context.strokeStyle = colours.paper;
    context.fillStyle = colours.drone;
    for (const [dx, dy] of [[1, 1], [1, -1], [-1, 1], [-1, -1]]) {
      context.beginPath();
      context.arc(0.62 * size * dx, 0.62 * size * dy, 0.42 * size, 0, 2 * Math.PI);
      context.fill();
      context.stroke();
    }
    context.beginPath();
    context.moveTo(1.25 * size, 0);
    context.lineTo(-0.35 * size, 0.5 * size);
    context.lineTo(-0.35 * size, -0.5 * size);
    context.closePath();
    context.fill();
    context.stroke();
    context.restore();
  }
}
