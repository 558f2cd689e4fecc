// A grid as it is drawn, and what becomes of it when it is changed. Values are never changed in place. Whether a grid is
// right, the server alone says: here it is only drawn.
export const keyOf = (cell) => cell.join(',');
export const cellOf = (key) => key.split(',').map(Number);
export const same = (a, b) => Boolean(a) && Boolean(b) && a[0] === b[0] && a[1] === b[1];
const rounded = (value) => Math.round(value * 1e6) / 1e6;
const AXES = [0, 1], TOUCH = 1e-6;

// Of the mapping in the file; `rest` are keys that nobody draws.
export function fromValues({ resolution, width, height, origin, altitude, waypoints, blocked, ...rest }) {
  const { origin_wgs84: earth, heading_deg: heading, ...others } = rest;
  return Object.freeze({ resolution, width, height, origin, altitude, earth: earth ?? null, heading: heading ?? null, waypoints: waypoints || [], blocked: new Set((blocked || []).map(keyOf)), others });
}

export function toValues({ resolution, width, height, origin, altitude, earth, heading, waypoints, blocked, others }) {
  const place = earth === null ? (heading === null ? {} : { heading_deg: heading }) : { origin_wgs84: earth, heading_deg: heading ?? 0 };
  return { ...others, ...place, resolution, width, height, origin, altitude, waypoints, blocked: [...blocked].map(cellOf) };
}

export const inside = (grid, [x, y]) => x >= 0 && y >= 0 && x < grid.width && y < grid.height;
export const centre = (grid, [x, y]) => [grid.origin[0] + (x + 0.5) * grid.resolution, grid.origin[1] + (y + 0.5) * grid.resolution];
export const cellAt = (grid, point) => AXES.map((axis) => Math.floor((point[axis] - grid.origin[axis]) / grid.resolution));
export const high = (grid) => [grid.origin[0] + grid.width * grid.resolution, grid.origin[1] + grid.height * grid.resolution];

// Another area or another size of cells; waypoints and blocked cells stay where they are on the ground.
export function rearranged(grid, change) {
  const to = { ...grid, ...change }, factor = grid.resolution / to.resolution;
  const shift = AXES.map((axis) => (grid.origin[axis] - to.origin[axis]) / to.resolution);
  const middle = (cell) => AXES.map((axis) => Math.floor((cell[axis] + 0.5) * factor + shift[axis] + TOUCH));
  const covered = (cell) => {
    const [low, end] = [TOUCH, factor - TOUCH].map((more) => AXES.map((axis) => Math.floor(cell[axis] * factor + shift[axis] + more)));
    const found = [];
    for (let x = low[0]; x <= end[0]; x++) for (let y = low[1]; y <= end[1]; y++) found.push([x, y]);
    return found;
  };
  const cells = [...grid.blocked].map(cellOf).flatMap(factor === 1 ? (cell) => [middle(cell)] : covered);
  return Object.freeze({ ...to, waypoints: grid.waypoints.map(middle), blocked: new Set(cells.filter((cell) => inside(to, cell)).map(keyOf)) });
}

// Cells of another size over the same area.
export function recelled(grid, resolution) {
  const count = (cells) => Math.max(1, Math.ceil(cells * grid.resolution / resolution - TOUCH));
  return rearranged(grid, { resolution, width: count(grid.width), height: count(grid.height) });
}

// The area from corner to corner; with cells that are drawn already, theirs go on.
export function between(grid, one, other) {
  const drawn = grid.waypoints.length + grid.blocked.size > 0, step = grid.resolution;
  const low = AXES.map((axis) => Math.min(one[axis], other[axis])), top = AXES.map((axis) => Math.max(one[axis], other[axis]));
  const origin = AXES.map((axis) => rounded(drawn ? grid.origin[axis] + Math.round((low[axis] - grid.origin[axis]) / step) * step : Math.round(low[axis] * 10) / 10));
  const [width, height] = AXES.map((axis) => Math.max(1, Math.round((top[axis] - origin[axis]) / step)));
  return rearranged(grid, { origin, width, height });
}

// A border that is pulled, by whole cells; side: -1 low, 1 high, 0 none of the two, along each axis.
export function pulled(grid, side, point) {
  const origin = [...grid.origin], size = [grid.width, grid.height];
  for (const axis of AXES) {
    const cells = Math.round((point[axis] - grid.origin[axis]) / grid.resolution);
    if (side[axis] > 0) size[axis] = Math.max(1, cells);
    if (side[axis] < 0) {
      const cut = Math.min(size[axis] - 1, cells);
      origin[axis] = rounded(origin[axis] + cut * grid.resolution);
      size[axis] -= cut;
    }
  }
  return rearranged(grid, { origin, width: size[0], height: size[1] });
}

export const moved = (grid, by) => Object.freeze({ ...grid, origin: AXES.map((axis) => Math.round((grid.origin[axis] + by[axis]) * 100) / 100) });

export function block(grid, cells, on) {
  const blocked = new Set(grid.blocked);
  for (const cell of cells) if (inside(grid, cell)) blocked[on ? 'add' : 'delete'](keyOf(cell));
  return Object.freeze({ ...grid, blocked });
}

export function box([ax, ay], [bx, by]) {
  const found = [];
  for (let y = Math.min(ay, by); y <= Math.max(ay, by); y++) for (let x = Math.min(ax, bx); x <= Math.max(ax, bx); x++) found.push([x, y]);
  return found;
}

export const withWaypoints = (grid, waypoints) => Object.freeze({ ...grid, waypoints });

// Every cell beyond a fence through these cells is blocked; those that it passes through stay free.
export function fenced(grid, corners) {
  const beyond = box([0, 0], [grid.width - 1, grid.height - 1]).filter((cell) => !within(corners, cell));
  return block(grid, beyond, true);
}

function within(corners, [x, y]) {
  let odd = false;
  for (let i = 0, j = corners.length - 1; i < corners.length; j = i++) {
    const [[ax, ay], [bx, by]] = [corners[j], corners[i]], cross = (bx - ax) * (y - ay) - (by - ay) * (x - ax);
    const between1 = (value, one, other) => value >= Math.min(one, other) - 0.5 && value <= Math.max(one, other) + 0.5;
    // The line passes through the cell's inner half.
    if (between1(x, ax, bx) && between1(y, ay, by) && Math.abs(cross) <= 0.5 * Math.max(Math.abs(bx - ax), Math.abs(by - ay))) return true;
    if ((ay > y) !== (by > y) && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) odd = !odd;
  }
  return odd;
}
