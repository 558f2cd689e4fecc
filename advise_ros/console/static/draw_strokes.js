// Mouse and fingers of the page that draws a grid: methods of its component. A stroke is one change, whatever it crosses.
import { HANDLES } from '/console/draw_painter.js';
import { between, block, cellAt, centre, inside, keyOf, moved, pulled, withWaypoints } from '/console/draw_grid.js';

const NEAR_PX = 24, DRAG_PX = 6;

export default {
  point(event) { const rect = this.$refs.canvas.getBoundingClientRect(); return [event.clientX - rect.left, event.clientY - rect.top]; },
  onDown(event) {
    this.$refs.board.focus({ preventScroll: true });
    this.pointers.set(event.pointerId, this.point(event));
    this.$refs.canvas.setPointerCapture(event.pointerId);
    if (this.pointers.size > 1) { this.giveUp(); this.stroke = { tool: 'hand' }; return; }
    const at = this.point(event), metres = this.board.metres(...at), cell = cellAt(this.grid, metres);
    if (inside(this.grid, cell)) this.cursor = cell;
    this.stroke = { tool: event.button ? 'hand' : this.tool, from: at, metres, cell, before: this.grid, shift: event.shiftKey };
    this.begin();
  },
  begin() {
    const { stroke } = this, { cell } = stroke;
    if (stroke.tool === 'area') stroke.side = this.nearHandle(stroke.from);
    if (stroke.tool === 'wall' && inside(this.grid, cell)) { stroke.on = !this.grid.blocked.has(keyOf(cell)); this.take(block(this.grid, [cell], stroke.on)); stroke.last = cell; }
    if (stroke.tool === 'box' && inside(this.grid, cell)) this.box = [cell, cell];
    if (stroke.tool === 'waypoint') this.beginWaypoint(cell);
  },
  beginWaypoint(cell) {
    const { stroke } = this, at = this.nearWaypoint(stroke.from, cell);
    if (at >= 0 && !stroke.shift) { stroke.index = at; this.held = at; return; }
    if (!inside(this.grid, cell)) return;
    stroke.index = this.grid.waypoints.length;
    this.take(withWaypoints(this.grid, [...this.grid.waypoints, cell]));
    this.held = stroke.index;
  },
  // In this cell, or near by where cells are small, and those that lie outside.
  nearWaypoint(from, cell) {
    const here = this.waypointAt(cell);
    if (here >= 0 || (inside(this.grid, cell) && this.grid.resolution * this.board.view.scale > NEAR_PX)) return here;
    return this.grid.waypoints.findLastIndex((one) => Math.hypot(...this.board.screen(centre(this.grid, one)).map((value, axis) => value - from[axis])) < NEAR_PX / 2);
  },
  nearHandle(from) {
    const near = (side) => Math.hypot(...this.board.handle(this.grid, side).map((value, axis) => value - from[axis])) < NEAR_PX;
    return HANDLES.find(near) || (near([0, 0]) ? [0, 0] : null);
  },
  onMove(event) {
    const before = this.pointers.get(event.pointerId), now = this.point(event);
    if (!before || !this.stroke) return;
    const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
    this.pointers.set(event.pointerId, now);
    if (this.stroke.tool === 'hand') { this.lead(before, now, other); return; }
    this.draw(now);
  },
  // Moves the map, by two fingers also its size.
  lead(before, now, other) {
    if (other) {
      const spread = ([x, y]) => Math.max(1, Math.hypot(x - other[0], y - other[1]));
      this.board.zoom(spread(now) / spread(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
    }
    const share = other ? 2 : 1;
    this.board.pan((now[0] - before[0]) / share, (now[1] - before[1]) / share);
    this.paint();
  },
  draw(now) {
    const { stroke } = this, metres = this.board.metres(...now), cell = cellAt(this.grid, metres), far = Math.hypot(now[0] - stroke.from[0], now[1] - stroke.from[1]) >= DRAG_PX;
    stroke.moved = stroke.moved || far;
    if (stroke.tool === 'area' && stroke.moved) this.drawArea(metres);
    else if (stroke.tool === 'wall' && stroke.last) this.drawWall(cell);
    else if (stroke.tool === 'box' && this.box) this.box = [this.box[0], [0, 1].map((axis) => Math.min(Math.max(cell[axis], 0), [this.grid.width, this.grid.height][axis] - 1))];
    else if (stroke.tool === 'waypoint' && stroke.index !== undefined && stroke.moved && inside(this.grid, cell)) this.take(withWaypoints(this.grid, this.grid.waypoints.map((one, index) => (index === stroke.index ? cell : one))));
  },
  drawArea(metres) {
    const { side, before, metres: from } = this.stroke;
    if (!side) this.take(between(before, from, metres));
    else if (side[0] || side[1]) this.take(pulled(before, side, metres));
    else this.take(moved(before, [0, 1].map((axis) => metres[axis] - from[axis])));
  },
  // Every cell on the way, however fast the hand was.
  drawWall(cell) {
    const { last, on } = this.stroke, count = Math.max(1, Math.abs(cell[0] - last[0]), Math.abs(cell[1] - last[1]));
    const way = Array.from({ length: count }, (_, step) => [0, 1].map((axis) => Math.round(last[axis] + (cell[axis] - last[axis]) * (step + 1) / count)));
    this.take(block(this.grid, way, on));
    this.stroke.last = cell;
  },
  onUp(event) {
    this.pointers.delete(event.pointerId);
    const { stroke } = this;
    if (!stroke || this.pointers.size) return;
    this.stroke = null;
    if (stroke.tool === 'fence') this.addCorner(stroke.cell);
    else if (stroke.tool === 'box' && this.box) this.fillBox(...this.box);
    else if (stroke.before && this.grid !== stroke.before) { const after = this.grid; this.grid = stroke.before; this.change(after, stroke.before); }
  },
  onCancel(event) { this.pointers.delete(event.pointerId); this.giveUp(); },
  giveUp() {
    if (this.stroke?.before) this.take(this.stroke.before);
    this.stroke = this.box = this.corner = null;
  },
  onWheel(event) { this.board.zoom(Math.exp(-event.deltaY / 400), ...this.point(event)); this.paint(); },
};
