// One map on two canvases: what changes with the question below, what moves above.
import { Painter } from '/console/painter.js';

const CELL_MOST = 150;

export default {
  props: { map: Object, view: Object, dark: Boolean, small: Boolean, label: String, drawing: Boolean, cursor: { type: Number, default: -1 } },
  emits: ['mark'],
  template: `
    <div class="map" ref="box">
      <canvas ref="base" :role="small ? null : 'img'" :aria-label="small ? null : label" :aria-hidden="small || null"></canvas>
      <canvas ref="over" class="over" aria-hidden="true" :class="{drawing}"
        @pointerdown="onDown" @pointermove="onMove" @pointerup="stroke = null"></canvas>
    </div>`,
  created() {
    this.stroke = null;
    this.moving = { drone: null, track: [], cursor: -1, moment: null };
  },
  mounted() {
    this.basePainter = new Painter(this.$refs.base);
    this.overPainter = new Painter(this.$refs.over);
    this.watcher = new ResizeObserver(() => this.repaint());
    this.watcher.observe(this.$refs.box);
    if (!this.small) this.paint();
  },
  unmounted() { this.watcher.disconnect(); },
  watch: {
    view() { this.repaint(); },
    map() { this.repaint(); },
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
    paint() {
      if (!this.$refs.box) return;
      const width = Math.floor(this.$refs.box.clientWidth);
      if (!this.map || !width) return;
      const most = this.small ? width : Math.min(this.map.width * CELL_MOST, Math.max(280, (window.innerHeight - 150) * this.map.width / this.map.height));
      if (!this.small) this.$refs.box.style.maxWidth = `${Math.floor(most)}px`;
      const room = Math.min(width, most);
      this.basePainter.fit(this.map, room, this.dark);
      this.overPainter.fit(this.map, room, this.dark);
      this.basePainter.base(this.view);
      this.move(this.moving);
      if (!this.small) performance.mark('map-painted');
    },
    // moving: {drone, track, moment}; called often, so it goes past Vue.
    move(moving) {
      this.moving = moving;
      if (this.map && this.overPainter?.map) this.overPainter.over({ ...moving, cursor: this.cursor });
    },
    onDown(event) {
      if (!this.drawing) return;
      event.target.setPointerCapture(event.pointerId);
      this.stroke = { on: null, seen: new Set() };
      this.onMove(event);
    },
    onMove(event) {
      if (!this.stroke) return;
      const cell = this.overPainter.cellAt(event.offsetX, event.offsetY);
      if (cell < 0 || this.stroke.seen.has(cell)) return;
      this.stroke.seen.add(cell);
      this.stroke.on = this.stroke.on ?? !this.view.part.has(cell);
      this.$emit('mark', cell, this.stroke.on);
    },
  },
};
