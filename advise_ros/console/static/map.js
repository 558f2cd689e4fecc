// One map on two canvases: what changes with the question below, what moves above. The large one zooms, pans and follows the question.
import { Painter } from '/console/painter.js';

// Cells that are smaller than this [css px] cannot be read: the map then goes to the question.
const READABLE = 30, MARGIN_CELLS = 3;

export default {
  props: { map: Object, view: Object, dark: Boolean, small: Boolean, label: String, drawing: Boolean, cursor: { type: Number, default: -1 } },
  emits: ['mark'],
  template: `
    <div class="map" ref="box" :class="{small}">
      <canvas ref="base" :role="small ? null : 'img'" :aria-label="small ? null : label" :aria-hidden="small || null"></canvas>
      <canvas ref="over" class="over" aria-hidden="true" :class="{drawing, near}" data-test="over" @wheel="onWheel" @dblclick="whole"
        @pointerdown="onDown" @pointermove="onMove" @pointerup="onUp" @pointercancel="onUp"></canvas>
    </div>`,
  data: () => ({ near: false }),
  created() {
    this.stroke = null;
    this.pointers = new Map();
    this.moved = false; // By the person; else it follows the question, at any size.
    this.section = null; // {cell, x, y} [css px] while it is not the whole map.
    this.moving = { drone: null, track: [], cursor: -1, moment: null };
  },
  mounted() {
    this.basePainter = new Painter(this.$refs.base);
    this.overPainter = new Painter(this.$refs.over);
    this.watcher = new ResizeObserver(() => (this.small || this.moved ? this.repaint() : this.follow()));
    this.watcher.observe(this.$refs.box);
    if (this.small) return;
    this.follow();
  },
  unmounted() { this.watcher.disconnect(); },
  watch: {
    view(now, before) { if (!this.small && now?.layer !== before?.layer) this.follow(); else this.repaint(); },
    map() { if (this.small) this.repaint(); else this.follow(); },
    dark() { this.repaint(); },
    cursor() { this.move(this.moving); },
  },
  methods: {
    // The small maps wait until the large one is on the screen.
    repaint() {
      if (!this.small) return this.paint();
      cancelAnimationFrame(this.due);
      this.due = requestAnimationFrame(() => setTimeout(() => this.paint()));
    },
    room() {
      const { clientWidth: width, clientHeight: height } = this.$refs.box;
      return this.small ? [width, Math.ceil(width * this.map.height / this.map.width)] : [width, height];
    },
    paint() {
      if (!this.$refs.box || !this.map) return;
      const [width, height] = this.room();
      if (!width || !height || !this.view) return;
      for (const painter of [this.basePainter, this.overPainter]) painter.fit(this.map, width, height, { dark: this.dark, section: this.section, axes: !this.small });
      this.basePainter.base(this.view);
      this.move(this.moving);
      if (!this.small) performance.mark('map-painted');
    },
    // moving: {drone, track, moment}; called often, so it goes past Vue.
    move(moving) {
      this.moving = moving;
      if (this.map && this.overPainter?.map) this.overPainter.over({ ...moving, cursor: this.cursor });
    },
    // -- the section of the map that is seen ------------------------------------------------
    show(section) {
      this.section = section && section.cell > this.fitted() * 1.001 ? section : null;
      this.near = Boolean(this.section);
      this.paint();
    },
    fitted() { return this.basePainter.whole(this.map, ...this.room(), true).cell; },
    here() { return this.section || this.basePainter.whole(this.map, ...this.room(), true); },
    zoom(factor, x = this.room()[0] / 2, y = this.room()[1] / 2) {
      if (!this.map) return;
      this.moved = true;
      const { cell, x: left, y: top } = this.here(), most = Math.max(this.fitted(), 150), size = Math.min(most, Math.max(this.fitted(), cell * factor));
      this.show({ cell: size, x: x - (x - left) * size / cell, y: y - (y - top) * size / cell });
    },
    pan(dx, dy) { this.moved = true; if (this.section) this.show({ ...this.section, x: this.section.x + dx, y: this.section.y + dy }); },
    whole() { this.moved = true; this.show(null); },
    // The whole map where its cells can be read, else the question's.
    follow(near = false) {
      const asked = [...(this.view?.asked.size ? this.view.asked : [])], [width, height] = this.map ? this.room() : [0, 0];
      if (!width || !height) return;
      this.moved = false;
      if (!asked.length || (!near && this.fitted() >= READABLE)) return this.show(null);
      const columns = asked.map((cell) => cell % this.map.width), rows = asked.map((cell) => this.map.height - 1 - Math.floor(cell / this.map.width));
      const [west, east, north, south] = [Math.min(...columns), Math.max(...columns) + 1, Math.min(...rows), Math.max(...rows) + 1];
      const wanted = Math.min(width / (east - west + 2 * MARGIN_CELLS), height / (south - north + 2 * MARGIN_CELLS));
      const cell = Math.max(this.fitted(), Math.min(Math.max(READABLE, wanted), 64));
      this.show({ cell, x: width / 2 - cell * (west + east) / 2, y: height / 2 - cell * (north + south) / 2 });
    },
    onWheel(event) {
      if (this.small) return;
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY / 400), event.offsetX, event.offsetY);
    },
    // -- fingers and mouse: one draws or moves the map, two zoom ----------------------------
    onDown(event) {
      if (this.small) return;
      this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
      event.target.setPointerCapture(event.pointerId);
      this.stroke = this.drawing && this.pointers.size === 1 ? { on: null, seen: new Set() } : null;
      if (this.stroke) this.draw(event);
    },
    onMove(event) {
      const before = this.pointers.get(event.pointerId);
      if (!before) return;
      if (this.stroke) return this.draw(event);
      const now = [event.offsetX, event.offsetY], other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
      this.pointers.set(event.pointerId, now);
      if (!other) return this.pan(now[0] - before[0], now[1] - before[1]);
      const spread = ([x, y]) => Math.max(1, Math.hypot(x - other[0], y - other[1]));
      this.zoom(spread(now) / spread(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
      this.pan((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
    },
    onUp(event) { this.pointers.delete(event.pointerId); this.stroke = null; },
    draw(event) {
      const cell = this.overPainter.cellAt(event.offsetX, event.offsetY);
      if (cell < 0 || this.stroke.seen.has(cell)) return;
      this.stroke.seen.add(cell);
      this.stroke.on = this.stroke.on ?? !this.view.part.has(cell);
      this.$emit('mark', cell, this.stroke.on);
    },
  },
};
