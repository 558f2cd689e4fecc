// The keyboard of the page that draws a grid: methods of its component. Everything that a mouse can do.
import { block, centre, inside, keyOf, withWaypoints } from '/console/draw_grid.js';
import { TOOLS } from '/console/draw_tables.js';

const ARROW = { ArrowUp: [0, 1], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowLeft: [-1, 0] };

export default {
  key(event) {
    const typing = event.target.closest?.('input:not([type=checkbox], [type=range]), select'), control = event.ctrlKey || event.metaKey;
    if (control && event.key.toLowerCase() === 's') { event.preventDefault(); event.target.blur(); this.save(); return; }
    if (event.key === 'Escape') { this.help = false; this.fence = []; this.giveUp(); return; }
    if (typing || event.altKey || event.target.matches?.('[type=range]')) return;
    if (control ? this.controlKey(event) : this.plainKey(event)) event.preventDefault();
  },
  controlKey(event) {
    const key = event.key.toLowerCase();
    if (event.key in ARROW) { const [dx, dy] = ARROW[event.key]; this.board.pan(-80 * dx, 80 * dy); this.paint(); return true; }
    if (key === 'y' || (key === 'z' && event.shiftKey)) this.redo();
    else if (key === 'z') this.undo();
    else return false;
    return true;
  },
  plainKey(event) {
    const index = this.waypointAt(this.cursor), onButton = event.target.closest?.('button');
    const acts = {
      w: () => this.add(this.cursor), b: () => this.change(block(this.grid, [this.cursor], !this.grid.blocked.has(keyOf(this.cursor)))), '?': () => { this.help = !this.help; },
      '<': () => this.reorder(index, -1), '>': () => this.reorder(index, 1), '+': () => this.zoom(1.25), '-': () => this.zoom(0.8), 0: () => this.whole(),
      Delete: () => (index >= 0 ? this.remove(index) : this.change(block(this.grid, [this.cursor], false))),
    };
    if (event.key in ARROW) return this.walk(ARROW[event.key], event.shiftKey ? index : -1);
    if (event.key === 'Enter' && !onButton) { this.use(this.cursor); return true; }
    if (/^[1-6]$/.test(event.key)) { this.pick(TOOLS[Number(event.key) - 1].name); return true; }
    const act = acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (act) act();
    return Boolean(act);
  },
  walk(by, index) {
    const to = [this.cursor[0] + by[0], this.cursor[1] + by[1]];
    if (!inside(this.grid, to)) return true;
    this.$refs.board.focus({ preventScroll: true });
    if (index >= 0) this.change(withWaypoints(this.grid, this.grid.waypoints.map((one, at) => (at === index ? to : one))));
    this.cursor = to;
    if (this.corner) this.box = [this.corner, to];
    this.keepInSight();
    return true;
  },
  keepInSight() {
    const [x, y] = this.board.screen(centre(this.grid, this.cursor)), edge = 30;
    this.board.pan(Math.max(0, edge - x) - Math.max(0, x - this.board.width + edge), Math.max(0, edge - y) - Math.max(0, y - this.board.height + edge));
  },
};
