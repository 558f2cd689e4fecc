// The page on which a person draws a grid file. The server says whether the drawing is right, by the sentences of the file's loader.
import { Link } from '/console/link.js';
import keys from '/console/draw_keys.js';
import strokes from '/console/draw_strokes.js';
import { Board } from '/console/draw_painter.js';
import { between, block, box, fenced, fromValues, high, inside, keyOf, same, toValues, withWaypoints } from '/console/draw_grid.js';
import { HEADING, KEYS, NUMBERS, PLACING, TOOLS } from '/console/draw_tables.js';
import { choose as chooseLanguage, language, number, speak, t, tn } from '/console/language.js';
import template from '/console/draw_template.js';

const CHECK_AFTER_MS = 120, LOOK_MS = 100, NOTE_MS = 10000, KEPT = 200;
// As guard and bridge have it where nobody sets it.
const FENCE_MARGIN_M = 1;

export default {
  props: { start: Object, words: Object },
  template,
  data() {
    return {
      grid: fromValues(this.start.values), past: [], future: [], wrong: {}, drafts: {}, verdict: null, tool: this.start.opened ? 'waypoint' : 'area', cursor: [0, 0], focused: false, held: -1, fence: [], box: null, corner: null,
      name: this.start.name, exists: null, saved: null, note: null, help: false, up: false, dirty: false,
      picture: null, corners: this.start.corners || null, hidden: this.start.hidden, strength: 1, cornersText: (this.start.corners || []).map((point) => point.join(',')).join(' '), onEarth: false,
      theme: localStorage.getItem('advise-theme') || 'auto', systemDark: matchMedia('(prefers-color-scheme: dark)').matches,
    };
  },
  computed: {
    language: () => language, tools: () => TOOLS, keys: () => KEYS, numbers: () => NUMBERS, placing: () => PLACING,
    dark() { return this.theme === 'dark' || (this.theme === 'auto' && this.systemDark); },
    themeName() { return { auto: t('automatic'), dark: t('dark'), light: t('light') }[this.theme]; },
    hint() { return this.fence.length ? tn('{n} corner. Touch the first one again, or press the button, to close the fence.', '{n} corners. Touch the first one again, or press the button, to close the fence.', this.fence.length) : t(TOOLS.find((one) => one.name === this.tool).hint); },
    sentence() {
      if (!this.verdict) return t('Checking …');
      return this.verdict.ok ? t('This grid can be flown.') : this.verdict.message;
    },
    // Cells that the sentence names.
    rings() { return this.verdict && !this.verdict.ok ? [...this.verdict.message.matchAll(/\[(\d+), (\d+)\]/g)].map((found) => [Number(found[1]), Number(found[2])]).filter((cell) => inside(this.grid, cell)) : []; },
    boardLabel() { return t('Map of {width} x {height} cells, {waypoints} waypoints, {blocked} cells blocked. Arrows move the cursor.', { width: this.grid.width, height: this.grid.height, waypoints: this.grid.waypoints.length, blocked: this.grid.blocked.size }); },
    cursorText() {
      const numbers = this.grid.waypoints.flatMap((cell, index) => (same(cell, this.cursor) ? [index + 1] : [])), words = [`[${this.cursor.join(', ')}]`];
      if (numbers.length) words.push(t('waypoint {n}', { n: numbers.join(', ') }));
      if (this.grid.blocked.has(keyOf(this.cursor))) words.push(t('blocked'));
      return words.join(', ');
    },
    scene() {
      return { grid: this.grid, picture: this.picture, corners: this.corners, strength: this.strength, tool: this.tool, cursor: this.focused ? this.cursor : null, rings: this.rings, fence: this.fence, box: this.box, margin: FENCE_MARGIN_M, words: t('fence'), north: this.grid.heading ?? 0, held: this.held };
    },
  },
  watch: {
    grid() { this.saved = this.exists = null; this.dirty = true; this.check(); },
    wrong() { this.check(); },
    scene() { this.paint(); },
    dark: { immediate: true, handler(dark) { document.documentElement.dataset.theme = dark ? 'dark' : 'light'; this.$nextTick(() => this.resize()); } },
    theme(theme) { localStorage.setItem('advise-theme', theme); },
    up(up) { if (up) this.check(); },
  },
  created() {
    speak(this.words);
    this.link = new Link((...args) => this.$emit(...args), () => {});
    this.pointers = new Map();
    this.stroke = null;
    this.checks = 0;
  },
  mounted() {
    document.title = t('Draw a grid');
    this.board = new Board(this.$refs.canvas);
    new ResizeObserver(() => this.resize()).observe(this.$refs.board);
    setInterval(() => { this.up = this.link.look(); }, LOOK_MS);
    document.addEventListener('keydown', (event) => this.key(event));
    window.addEventListener('beforeunload', (event) => { if (this.dirty) event.preventDefault(); });
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', (event) => { this.systemDark = event.matches; });
    if (this.start.picture) this.show(this.start.picture);
  },
  methods: {
    ...keys, ...strokes,
    t, tn, number, chooseLanguage,
    welcome(line) { this.link.welcome(line); this.up = this.link.look(); },
    reply(id, reply) { this.link.reply(id, reply); },
    nextTheme() { this.theme = { auto: 'dark', dark: 'light', light: 'auto' }[this.theme]; },
    tell(text, bad = false) {
      clearTimeout(this.noteTimer);
      this.note = { text, bad };
      this.noteTimer = setTimeout(() => { this.note = null; }, NOTE_MS);
    },
    isInside(cell) { return inside(this.grid, cell); },
    metres(cells) { return number(cells * this.grid.resolution, 1); },
    // -- changes -------------------------------------------------------------------------
    // Takes a new grid and keeps the one before; a stroke of many is one change.
    change(grid, before = this.grid) {
      if (grid === before) return;
      this.past = [...this.past.slice(-KEPT), before];
      this.future = [];
      this.take(grid, before);
    },
    take(grid, before) {
      this.grid = Object.freeze(grid);
      this.held = this.held < grid.waypoints.length ? this.held : -1;
      this.cursor = [Math.min(this.cursor[0], grid.width - 1), Math.min(this.cursor[1], grid.height - 1)];
      if (before && before.blocked.size > grid.blocked.size && (before.width !== grid.width || before.height !== grid.height) && before.resolution === grid.resolution) {
        this.tell(tn('{n} blocked cell lies outside now and is dropped; undo brings it back.', '{n} blocked cells lie outside now and are dropped; undo brings them back.', before.blocked.size - grid.blocked.size));
      }
    },
    undo() { this.step('past', 'future'); },
    redo() { this.step('future', 'past'); },
    step(from, to) {
      if (!this[from].length) return;
      this[to] = [...this[to], this.grid];
      const grid = this[from].at(-1);
      this[from] = this[from].slice(0, -1);
      this.wrong = {};
      this.take(grid);
    },
    // -- the server ----------------------------------------------------------------------
    values() {
      const values = toValues(this.grid);
      for (const [field, value] of Object.entries(this.wrong)) {
        const [key, at] = { latitude: ['origin_wgs84', 0], longitude: ['origin_wgs84', 1], heading: ['heading_deg'] }[field] || field.split('-');
        if (at === undefined) values[key] = value;
        else values[key] = Object.assign([...(values[key] || [null, null])], { [at]: value });
      }
      return values;
    },
    check() {
      clearTimeout(this.checkTimer);
      this.checkTimer = setTimeout(async () => {
        const number_ = ++this.checks, verdict = await this.link.send('check', { values: this.values() });
        if (number_ !== this.checks) return;
        this.verdict = verdict;
        if (verdict.corners !== undefined) { this.corners = verdict.corners; this.hidden = verdict.hidden; }
      }, CHECK_AFTER_MS);
    },
    async save(name = this.name, replace = false) {
      const reply = await this.link.send('save', { values: this.values(), name, replace });
      this.exists = reply.exists ? reply : null;
      this.saved = reply.ok ? reply : null;
      if (reply.ok) { this.name = name; this.dirty = false; }
      this.$nextTick(() => this.$refs.outcome?.scrollIntoView({ block: 'nearest' }));
      if (!reply.ok && !reply.exists) this.tell(t('Not saved: {why}', { why: reply.message }), true);
    },
    async readWalls() {
      const reply = await this.link.send('obstacles', { values: this.values() });
      if (!reply.ok) { this.tell(reply.message, true); return; }
      this.change(block(this.grid, reply.blocked, true));
    },
    freeAll() { this.change({ ...this.grid, blocked: new Set() }); },
    // -- numbers -------------------------------------------------------------------------
    shown({ key, field, at }) {
      if (key in this.drafts) return this.drafts[key]; // What is being typed stays, whatever comes meanwhile.
      if (key in this.wrong) return this.wrong[key];
      const value = field ? this.grid[field] : key === HEADING ? this.grid.heading : this.grid.earth;
      return at === undefined ? value : value?.[at];
    },
    edit(one, raw) {
      delete this.drafts[one.key];
      const text = raw.trim().replace(',', '.'), value = text === '' ? null : Number.isFinite(Number(text)) ? Number(text) : raw.trim();
      const { [one.key]: _, ...others } = one.size ? this.withoutSizes() : this.wrong;
      const drawable = Number.isFinite(value) && (!one.size || (value > 0 && value < 1e6)) && (!one.whole || Number.isInteger(value));
      if (drawable && one.key === 'resolution' && this.tooSmall(value, others)) return;
      if (one.field ? drawable : one.key === HEADING && Number.isFinite(value)) {
        this.wrong = others;
        this.change(one.field ? one.set(this.grid, value) : { ...this.grid, heading: value });
      } else if (!one.field && one.key !== HEADING) this.onEarthAt(one, value, others);
      else this.wrong = { ...others, [one.key]: value };
    },
    withoutSizes() { return Object.fromEntries(Object.entries(this.wrong).filter(([key]) => !NUMBERS.some((one) => one.size && one.key === key))); },
    // More cells than can be drawn are not: the server says so.
    tooSmall(resolution, others) {
      const [width, height] = [this.grid.width, this.grid.height].map((cells) => Math.ceil(cells * this.grid.resolution / resolution));
      if (width * height <= this.start.most) return false;
      this.wrong = { ...others, resolution, width, height };
      return true;
    },
    // Latitude and longitude belong together: until both are there, the loader says what is missing.
    onEarthAt(one, value, others) {
      const earth = [0, 1].map((at) => { const { key } = PLACING[at]; return at === one.at ? value : key in others ? others[key] : this.grid.earth?.[at] ?? null; });
      if (earth.every(Number.isFinite)) {
        const { latitude: _, longitude: __, ...rest } = others;
        this.wrong = rest;
        this.change({ ...this.grid, earth });
      } else if (earth.every((each) => each === null)) this.noPlace();
      else this.wrong = { ...others, latitude: earth[0], longitude: earth[1] };
    },
    noPlace() {
      this.wrong = Object.fromEntries(Object.entries(this.wrong).filter(([key]) => !PLACING.some((one) => one.key === key)));
      this.change({ ...this.grid, earth: null, heading: null });
    },
    // -- waypoints -----------------------------------------------------------------------
    waypointAt(cell) { return this.grid.waypoints.findLastIndex((one) => same(one, cell)); },
    add(cell) {
      if (!inside(this.grid, cell)) return;
      this.change(withWaypoints(this.grid, [...this.grid.waypoints, cell]));
      this.held = this.grid.waypoints.length - 1;
    },
    remove(index) { this.change(withWaypoints(this.grid, this.grid.waypoints.filter((_, at) => at !== index))); this.held = -1; },
    reorder(index, by) {
      const waypoints = [...this.grid.waypoints], other = index + by;
      if (index < 0 || other < 0 || other >= waypoints.length) return;
      [waypoints[index], waypoints[other]] = [waypoints[other], waypoints[index]];
      this.change(withWaypoints(this.grid, waypoints));
      this.held = other;
    },
    hold(index) {
      this.held = this.held === index ? -1 : index;
      if (this.held >= 0 && inside(this.grid, this.grid.waypoints[index])) this.cursor = this.grid.waypoints[index];
      this.pick('waypoint');
    },
    // -- the tools -----------------------------------------------------------------------
    pick(name) { this.tool = name; this.fence = []; this.box = this.corner = null; },
    closeFence() {
      if (this.fence.length > 2 && !this.tooMany()) this.change(fenced(this.grid, this.fence));
      this.fence = [];
    },
    addCorner(cell) {
      if (!inside(this.grid, cell)) return;
      if (this.fence.length > 2 && same(cell, this.fence[0])) this.closeFence();
      else if (!this.fence.some((one) => same(one, cell))) this.fence = [...this.fence, cell];
    },
    tooMany() {
      const many = this.grid.width * this.grid.height > this.start.most;
      if (many) this.tell(this.sentence, true);
      return many;
    },
    fillBox(one, other) { if (!this.tooMany()) this.change(block(this.grid, box(one, other), !this.grid.blocked.has(keyOf(one)))); this.box = this.corner = null; },
    // Enter: the tool in the cell under the cursor; what goes from corner to corner takes two of them.
    use(cell) {
      if (this.tool === 'waypoint') this.add(cell);
      else if (this.tool === 'wall') this.change(block(this.grid, [cell], !this.grid.blocked.has(keyOf(cell))));
      else if (this.tool === 'fence') this.addCorner(cell);
      else if (this.tool === 'box' || this.tool === 'area') {
        if (!this.corner) { this.corner = cell; this.box = [cell, cell]; return; }
        const one = this.corner;
        if (this.tool === 'box') { this.fillBox(one, cell); return; }
        const [low, top] = [Math.min, Math.max].map((end) => [0, 1].map((axis) => end(one[axis], cell[axis])));
        const at = (axis, count) => this.grid.origin[axis] + count * this.grid.resolution;
        this.change(between(this.grid, [at(0, low[0]), at(1, low[1])], [at(0, top[0] + 1), at(1, top[1] + 1)]));
        this.box = this.corner = null;
      }
    },
    // -- what is seen --------------------------------------------------------------------
    zoom(factor) { this.board.zoom(factor); this.paint(); },
    whole() {
      this.board.whole([this.grid.origin, high(this.grid), ...(this.picture && this.corners ? this.corners : [])]);
      this.paint();
    },
    resize() {
      const { clientWidth: width, clientHeight: height } = this.$refs.board || {};
      if (!width || !height || !this.board) return;
      this.board.fit(width, height);
      if (this.board.view) this.paint(); else this.whole();
    },
    paint() { if (this.board?.view) this.board.paint(this.scene); },
    // -- the picture ---------------------------------------------------------------------
    show(source, chosen = false) {
      const picture = new Image();
      picture.onload = () => { this.picture = Object.freeze(picture); if (chosen) this.placeOnArea(); this.$nextTick(() => this.whole()); };
      picture.onerror = () => this.tell(t('This is no picture that can be shown; save it as PNG or JPEG.'), true);
      picture.src = source;
    },
    load(event) {
      const [file] = event.target.files;
      if (!file) return;
      const reader = new FileReader();
      reader.onload = () => this.show(reader.result, true);
      reader.readAsDataURL(file);
    },
    // Until its corners are named: over the width of the area.
    placeOnArea() {
      const wide = this.grid.width * this.grid.resolution, [x, y] = this.grid.origin, round = (value) => Math.round(value * 100) / 100;
      this.cornersText = `${x},${y} ${round(x + wide)},${round(y + wide * this.picture.height / this.picture.width)}`;
      this.onEarth = false;
      this.place();
      this.tell(t('Name the corners of the picture, so that it has its right size and place.'));
    },
    async place() {
      const reply = await this.link.send('place', { values: this.values(), corners: this.cornersText, on_earth: this.onEarth });
      if (!reply.ok) { this.tell(reply.message, true); return; }
      this.corners = reply.corners;
      this.hidden = null;
      this.$nextTick(() => this.whole());
    },
  },
};
