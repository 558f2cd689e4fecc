// Draws one map: cells, walls, waypoints, the question, arrows, routes, the drone. Knows no page and no state.
import { STEP } from '/console/words.js';

const LIGHT = {
  paper: '#ffffff', line: '#d5dce2', ink: '#16202a', wall: '#3c4650', asked: '#A86A00', askedFill: '#fde7b5', flown: '#0072B2',
  policy: '#16202a', route: '#5b6875', change: '#00754f', changeFill: '#c9efe0', clash: '#b8330f', drone: '#8a1c6a',
  heat: [[255, 255, 255], [120, 94, 180]], part: '#0072B2', keepOut: '#d1462f', disputed: '#A31F00', keep: '#5b2fb0', through: '#855400',
};
const DARK = {
  paper: '#141b22', line: '#33404c', ink: '#f2f5f7', wall: '#8793a0', asked: '#F5B82E', askedFill: '#5a4308', flown: '#56B4E9',
  policy: '#f2f5f7', route: '#9aa8b5', change: '#35d39a', changeFill: '#0d4a37', clash: '#ff8a5c', drone: '#ff8ad8',
  heat: [[20, 27, 34], [150, 120, 220]], part: '#56B4E9', keepOut: '#e0573c', disputed: '#ff9a7a', keep: '#bda2ff', through: '#F5B82E',
};
const LEVELS = 35, TRACK_PARTS = 6;
// Per cent below which a cell is as good as free.
const KEEP_OUT_LEAST = 5;

export class Painter {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d');
  }

  // Prepare the canvas for `map` in a box of `width` css pixels; returns the height in css pixels.
  fit(map, width, dark, margin = 4) {
    const ratio = window.devicePixelRatio || 1;
    this.colours = dark ? DARK : LIGHT;
    this.map = map;
    this.cell = Math.max(2, (width - 2 * margin) / map.width);
    this.unit = Math.min(this.cell, 84); // Marks do not grow with very large cells.
    this.margin = margin;
    const height = Math.ceil(this.cell * map.height + 2 * margin);
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.canvas.style.width = `${width}px`;
    this.canvas.style.height = `${height}px`;
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
    return height;
  }

  left(cell) { return this.margin + (cell % this.map.width) * this.cell; }
  top(cell) { return this.margin + (this.map.height - 1 - Math.floor(cell / this.map.width)) * this.cell; }
  centre(cell) { return [this.left(cell) + this.cell / 2, this.top(cell) + this.cell / 2]; }
  at(east, north) {
    const x = (east - this.map.origin[0]) / this.map.resolution, y = (north - this.map.origin[1]) / this.map.resolution;
    return [this.margin + x * this.cell, this.margin + (this.map.height - y) * this.cell];
  }
  cellAt(x, y) {
    const column = Math.floor((x - this.margin) / this.cell);
    const row = this.map.height - 1 - Math.floor((y - this.margin) / this.cell);
    return column >= 0 && column < this.map.width && row >= 0 && row < this.map.height ? row * this.map.width + column : -1;
  }

  // view: {layer, asked, lit, disputed, keepOut, flown, greedy, unsure, changes, part, clash, routes, next, show, small}
  base(view) {
    const { context, map, colours } = this;
    context.fillStyle = colours.paper;
    context.fillRect(0, 0, this.canvas.width, this.canvas.height);
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
    if (this.cell < 34) return;
    context.font = `600 ${Math.round(Math.min(12, 0.22 * this.cell))}px system-ui, sans-serif`;
    context.textAlign = 'right';
    context.textBaseline = 'bottom';
    context.lineWidth = 3;
    for (let cell = 0; cell < shares.length; cell++) {
      if (shares[cell] < KEEP_OUT_LEAST) continue;
      const [text, x, y] = [`${shares[cell]}\u00a0%`, this.left(cell) + this.cell - 3, this.top(cell) + this.cell - 2];
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
    for (let x = 0; x <= map.width; x++) { context.moveTo(this.margin + x * this.cell, this.margin); context.lineTo(this.margin + x * this.cell, this.margin + map.height * this.cell); }
    for (let y = 0; y <= map.height; y++) { context.moveTo(this.margin, this.margin + y * this.cell); context.lineTo(this.margin + map.width * this.cell, this.margin + y * this.cell); }
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
      if (walls.has(cell) || view.final === cell || view.changes.has(cell)) continue;
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
    const radius = Math.max(small ? 6 : 8, Math.min(0.2 * this.cell, 15)), inset = Math.min(0.24 * this.cell, radius + 3);
    map.waypoints.forEach((cell, index) => {
      const x = this.left(cell) + Math.max(inset, radius * 0.7), y = this.top(cell) + Math.max(inset, radius * 0.7), ahead = index === next;
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
    const { context, colours } = this;
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
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
