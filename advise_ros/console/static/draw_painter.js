// Draws the board: picture, area, cells, walls, route, scale and north. Metres to points by {scale, x, y}; knows no page.
import { cellOf, centre, high, inside, keyOf } from '/console/draw_grid.js';

const NAMES = ['paper', 'ink', 'soft', 'line', 'accent', 'bad', 'card', 'wall', 'route', 'cell'];
const PAD = 34, BELOW = 34, LEAST_SCALE = 0.02, MOST_SCALE = 400, FONT = [600, 12];
export const HANDLES = [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

export class Board {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d');
    this.view = null;
  }

  fit(width, height) {
    const ratio = window.devicePixelRatio || 1;
    this.width = width;
    this.height = height;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const style = getComputedStyle(this.canvas);
    this.colours = Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  }

  // The whole of these points [m].
  whole(points) {
    const low = [0, 1].map((axis) => Math.min(...points.map((point) => point[axis]))), top = [0, 1].map((axis) => Math.max(...points.map((point) => point[axis])));
    const scale = Math.min((this.width - 2 * PAD) / Math.max(top[0] - low[0], 0.1), (this.height - 2 * PAD - BELOW) / Math.max(top[1] - low[1], 0.1));
    this.view = { scale, x: this.width / 2 - scale * (low[0] + top[0]) / 2, y: (this.height - BELOW) / 2 + scale * (low[1] + top[1]) / 2 };
  }

  zoom(factor, x = this.width / 2, y = this.height / 2) {
    const { scale, x: left, y: bottom } = this.view, next = Math.min(MOST_SCALE, Math.max(LEAST_SCALE, scale * factor));
    this.view = { scale: next, x: x - (x - left) * next / scale, y: y - (y - bottom) * next / scale };
  }

  pan(dx, dy) { this.view = { ...this.view, x: this.view.x + dx, y: this.view.y + dy }; }
  screen([x, y]) { return [this.view.x + x * this.view.scale, this.view.y - y * this.view.scale]; }
  metres(x, y) { return [(x - this.view.x) / this.view.scale, (this.view.y - y) / this.view.scale]; }

  handle(grid, side) {
    const top = high(grid);
    return this.screen([0, 1].map((axis) => (side[axis] < 0 ? grid.origin[axis] : side[axis] > 0 ? top[axis] : (grid.origin[axis] + top[axis]) / 2)));
  }

  // scene: {grid, picture, corners, strength, tool, cursor, rings, fence, box, margin, words, north, held}
  paint(scene) {
    const { context, colours } = this, { grid } = scene;
    context.fillStyle = colours.card;
    context.fillRect(0, 0, this.width, this.height);
    if (scene.picture && scene.corners) this.picture(scene);
    this.frame(scene);
    this.cells(grid, Boolean(scene.picture));
    this.walls(grid);
    if (scene.box) this.outlineBox(grid, scene.box);
    this.fence(grid, scene.fence);
    this.route(grid, scene.held);
    for (const cell of scene.rings) this.ring(grid, cell, colours.bad, 4);
    if (scene.cursor) this.ring(grid, scene.cursor, colours.accent, 3);
    if (scene.tool === 'area') this.handles(grid);
    this.axes(scene);
    this.scaleBar();
    this.north(scene.north);
  }

  picture({ picture, corners, strength }) {
    const { context } = this, [upperLeft, upperRight, , lowerLeft] = corners.map((point) => this.screen(point));
    context.save();
    context.globalAlpha = strength;
    context.transform(
      (upperRight[0] - upperLeft[0]) / picture.width, (upperRight[1] - upperLeft[1]) / picture.width,
      (lowerLeft[0] - upperLeft[0]) / picture.height, (lowerLeft[1] - upperLeft[1]) / picture.height, upperLeft[0], upperLeft[1],
    );
    context.drawImage(picture, 0, 0);
    context.restore();
  }

  rectOf(grid) {
    const [left, bottom] = this.screen(grid.origin), [right, top] = this.screen(high(grid));
    return [left, top, right - left, bottom - top];
  }

  cellRect(grid, [x, y]) {
    const side = grid.resolution * this.view.scale, [left, bottom] = this.screen(grid.origin);
    return [left + x * side, bottom - (y + 1) * side, side, side];
  }

  // What lies outside is dimmed; the fence of guard and bridge is dashed.
  frame({ grid, margin, words }) {
    const { context, colours } = this, rect = this.rectOf(grid);
    context.beginPath();
    context.rect(0, 0, this.width, this.height);
    context.rect(...rect);
    context.globalAlpha = 0.55;
    context.fillStyle = colours.paper;
    context.fill('evenodd');
    context.globalAlpha = 1;
    const more = margin * this.view.scale;
    context.setLineDash([7, 5]);
    this.twice(2, colours.bad, () => context.strokeRect(rect[0] - more, rect[1] - more, rect[2] + 2 * more, rect[3] + 2 * more));
    context.setLineDash([]);
    this.text(words, rect[0] + rect[2] / 2, Math.max(9, rect[1] - more - 11), colours.bad, FONT, colours.card);
    this.twice(2.5, colours.accent, () => context.strokeRect(...rect));
  }

  // First and last of `count` columns or rows that the canvas shows.
  seen(begin, side, count, room) { return [Math.max(0, Math.floor(-begin / side)), Math.min(count, Math.ceil((room - begin) / side))]; }

  // A line that is seen on any ground.
  twice(width, colour, draw) {
    const { context, colours } = this;
    for (const [wide, ink] of [[width + 2, colours.card], [width, colour]]) {
      context.lineWidth = wide;
      context.strokeStyle = ink;
      draw();
    }
  }

  cells(grid, pictured) {
    const { context, colours } = this, side = grid.resolution * this.view.scale, [left, top, width, height] = this.rectOf(grid);
    if (side < 4) return;
    const [west, east] = this.seen(left, side, grid.width, this.width), [north, south] = this.seen(top, side, grid.height, this.height);
    context.beginPath();
    for (let x = Math.max(1, west); x < east; x++) { context.moveTo(left + x * side, top); context.lineTo(left + x * side, top + height); }
    for (let y = Math.max(1, north); y < south; y++) { context.moveTo(left, top + y * side); context.lineTo(left + width, top + y * side); }
    for (const [wide, ink, alpha] of pictured ? [[2.5, colours.card, 0.45], [1, colours.ink, 0.55]] : [[1, colours.line, 1]]) {
      context.globalAlpha = alpha;
      context.lineWidth = wide;
      context.strokeStyle = ink;
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  walls(grid) {
    const { context, colours } = this, side = grid.resolution * this.view.scale;
    for (const key of grid.blocked) {
      const [x, y, width, height] = this.cellRect(grid, cellOf(key));
      if (x > this.width || y > this.height || x + width < 0 || y + height < 0) continue;
      context.globalAlpha = 0.8;
      context.fillStyle = colours.wall;
      context.fillRect(x, y, width + 0.5, height + 0.5);
      context.globalAlpha = 1;
      if (side < 9) continue;
      context.strokeStyle = colours.card;
      context.lineWidth = 1.5;
      context.beginPath();
      context.moveTo(x + side * 0.25, y + side * 0.25); context.lineTo(x + side * 0.75, y + side * 0.75);
      context.moveTo(x + side * 0.75, y + side * 0.25); context.lineTo(x + side * 0.25, y + side * 0.75);
      context.stroke();
    }
  }

  outlineBox(grid, [one, other]) {
    const low = [0, 1].map((axis) => Math.min(one[axis], other[axis])), size = [0, 1].map((axis) => Math.abs(one[axis] - other[axis]) + 1);
    const [x, y, side] = this.cellRect(grid, [low[0], low[1] + size[1] - 1]);
    this.twice(3, this.colours.accent, () => this.context.strokeRect(x, y, side * size[0], side * size[1]));
  }

  fence(grid, corners) {
    if (!corners.length) return;
    const { context, colours } = this, points = corners.map((cell) => this.screen(centre(grid, cell)));
    this.twice(3, colours.bad, () => { context.beginPath(); for (const point of points) context.lineTo(...point); context.stroke(); });
    for (const point of points) this.disc(point, 7, colours.bad);
  }

  disc([x, y], radius, colour) {
    const { context, colours } = this;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fillStyle = colour;
    context.fill();
    context.lineWidth = 2;
    context.strokeStyle = colours.card;
    context.stroke();
  }

  // The route and its numbers; the last one, where a flight ends and begins, is square.
  route(grid, held) {
    const { context, colours } = this, points = grid.waypoints.map((cell) => this.screen(centre(grid, cell)));
    // Dashed: it shows the order; the way between is the drone's.
    context.setLineDash([9, 6]);
    if (points.length > 1) this.twice(3, colours.route, () => { context.beginPath(); for (const point of points) context.lineTo(...point); context.stroke(); });
    context.setLineDash([]);
    const radius = Math.max(9, Math.min(16, 0.42 * grid.resolution * this.view.scale)), numbers = new Map();
    grid.waypoints.forEach((cell, index) => numbers.set(keyOf(cell), [...(numbers.get(keyOf(cell)) || []), index]));
    for (let index = 1; index < points.length; index++) this.arrow(points[index - 1], points[index], radius);
    for (const [key, all] of numbers) {
      const cell = cellOf(key), [x, y] = this.screen(centre(grid, cell)), last = all.includes(points.length - 1);
      const colour = inside(grid, cell) ? colours.route : colours.bad, size = all.includes(held) ? radius + 4 : radius;
      if (last) {
        context.fillStyle = colour;
        context.fillRect(x - size, y - size, 2 * size, 2 * size);
        context.strokeStyle = colours.card;
        context.lineWidth = 2;
        context.strokeRect(x - size, y - size, 2 * size, 2 * size);
      } else this.disc([x, y], size, colour);
      this.text(all.map((one) => one + 1).join(','), x, y + 0.5, colours.card, [700, Math.round(radius * (all.length > 1 ? 0.85 : 1.1))]);
    }
  }

  arrow(from, to, radius) {
    const { context, colours } = this, length = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (length < 3.2 * radius) return;
    const [dx, dy] = [(to[0] - from[0]) / length, (to[1] - from[1]) / length], [x, y] = [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2];
    context.beginPath();
    context.moveTo(x + 8 * dx, y + 8 * dy);
    context.lineTo(x - 5 * dx - 6 * dy, y - 5 * dy + 6 * dx);
    context.lineTo(x - 5 * dx + 6 * dy, y - 5 * dy - 6 * dx);
    context.closePath();
    context.fillStyle = colours.route;
    context.fill();
  }

  text(words, x, y, colour, [weight, size] = FONT, halo = null) {
    const { context } = this;
    context.font = `${weight} ${size}px system-ui, sans-serif`;
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    if (halo) {
      context.lineWidth = 4;
      context.lineJoin = 'round';
      context.strokeStyle = halo;
      context.strokeText(words, x, y);
    }
    context.fillStyle = colour;
    context.fillText(words, x, y);
  }

  ring(grid, cell, colour, width) {
    const [x, y, side] = this.cellRect(grid, cell);
    this.twice(width, colour, () => this.context.strokeRect(x, y, side, side));
  }

  handles(grid) {
    for (const side of HANDLES) this.disc(this.handle(grid, side), 9, this.colours.accent);
    const at = this.handle(grid, [0, 0]);
    this.disc(at, 15, this.colours.accent);
    this.text('✥', at[0], at[1] + 1, this.colours.card, [700, 18]);
  }

  // Columns and rows as the file counts them.
  axes({ grid, margin }) {
    const side = grid.resolution * this.view.scale, step = [1, 2, 5, 10, 20, 50, 100].find((one) => one * side >= 26) || 200, { colours } = this;
    const [left, top, , height] = this.rectOf(grid), more = margin * this.view.scale, away = more < 26 ? more + 13 : 14;
    const below = Math.min(this.height - 30, top + height + away), beside = Math.max(14, left - away);
    const [west, east] = this.seen(left, side, grid.width, this.width), bottom = top + height;
    const [south, north] = this.seen(this.height - bottom, side, grid.height, this.height), even = (index) => Math.ceil(index / step) * step;
    for (let x = even(west); x < east; x += step) this.text(String(x), left + (x + 0.5) * side, below, colours.ink, FONT, colours.card);
    for (let y = even(south); y < north; y += step) this.text(String(y), beside, bottom - (y + 0.5) * side, colours.ink, FONT, colours.card);
  }

  scaleBar() {
    const { context, colours } = this, wanted = 110 / this.view.scale, power = 10 ** Math.floor(Math.log10(wanted));
    const metres = [5, 2, 1].find((one) => one * power <= wanted) * power, long = metres * this.view.scale, y = this.height - 9;
    context.fillStyle = colours.card;
    context.globalAlpha = 0.85;
    context.fillRect(6, y - 13, long + 72, 20);
    context.globalAlpha = 1;
    context.lineWidth = 3;
    context.strokeStyle = colours.ink;
    context.beginPath();
    for (const [x, up] of [[12, -5], [12, 3], [12, -1], [12 + long, -1], [12 + long, -5], [12 + long, 3]]) context.lineTo(x, y + up);
    context.stroke();
    this.text(`${Number(metres.toPrecision(1))} m`, 12 + long + 30, y - 2, colours.ink);
  }

  north(heading) {
    const { context, colours } = this, [x, y] = [this.width - 30, 34];
    this.disc([x, y], 24, colours.card);
    context.save();
    context.translate(x, y);
    context.rotate(-heading * Math.PI / 180);
    context.beginPath();
    for (const point of [[0, -20], [7, 4], [0, 0], [-7, 4]]) context.lineTo(...point);
    context.closePath();
    context.fillStyle = colours.bad;
    context.fill();
    this.text('N', 0, 13, colours.ink, [700, 13]);
    context.restore();
  }
}
