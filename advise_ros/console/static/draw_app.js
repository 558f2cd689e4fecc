// The page on which a person draws a grid file. The server says whether the drawing is right, by the sentences of the file's loader.
import { Link } from '/console/link.js';
import { Board, HANDLES } from '/console/draw_painter.js';
import { between, block, box, cellAt, fenced, fromValues, high, inside, keyOf, moved, pulled, recelled, rearranged, same, toValues, withWaypoints } from '/console/draw_grid.js';
import { choose as chooseLanguage, language, mark, number, speak, t, tn } from '/console/language.js';
import template from '/console/draw_template.js';

const CHECK_AFTER_MS = 120, LOOK_MS = 100, NOTE_MS = 10000, NEAR_PX = 24, DRAG_PX = 6, KEPT = 200;
// As guard and bridge have it where nobody sets it.
const FENCE_MARGIN_M = 1;
const ARROW = { ArrowUp: [0, 1], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowLeft: [-1, 0] };

const TOOLS = [
  { name: 'area', sign: '⬚', label: mark('Area'), hint: mark('Drag from corner to corner. Pull a dot to enlarge or to cut off; the middle one moves everything.') },
  { name: 'waypoint', sign: '①', label: mark('Waypoints'), hint: mark('Touch cells in the order of flight; the last is the final position. Drag a waypoint to move it.') },
  { name: 'wall', sign: '▦', label: mark('Walls'), hint: mark('Draw over cells that may not be entered; begin on a blocked one to free cells.') },
  { name: 'box', sign: '◼', label: mark('Box'), hint: mark('Drag from corner to corner; all cells of the box are blocked, or freed if it begins on a blocked one.') },
  { name: 'fence', sign: '⬠', label: mark('Fence'), hint: mark('Touch the corner cells of the fence, then the first one again: all cells beyond it are blocked.') },
  { name: 'hand', sign: '✥', label: mark('Move'), hint: mark('Drag the map. With any tool two fingers or the wheel move and zoom it.') },
];
const KEYS = [
  ['1–6', mark('tools')], ['↑ → ↓ ←', mark('move the cursor')], ['⇧ ↑ → ↓ ←', mark('take the waypoint under the cursor along')], ['Enter', mark('use the tool in this cell')],
  ['w', mark('a waypoint here, the next in order')], ['⇧ ☝', mark('fly to a waypoint once more')], ['b', mark('block this cell, or free it')], ['Del', mark('remove the waypoint, or free the cell')],
  ['<, >', mark('the waypoint here earlier, later')], ['Ctrl Z, Ctrl Y', mark('undo, redo')], ['Ctrl S', mark('save')],
  ['+, −, 0', mark('larger, smaller, the whole map')], ['Ctrl ↑ → ↓ ←', mark('move the map')], ['?', mark('these keys')], ['Esc', mark('give up what was begun')],
];
const NUMBERS = [
  { key: 'resolution', field: 'resolution', label: mark('Cell size [m]'), set: (grid, value) => recelled(grid, value), size: true },
  { key: 'altitude', field: 'altitude', label: mark('Altitude [m]'), set: (grid, value) => ({ ...grid, altitude: value }) },
  { key: 'width', field: 'width', label: mark('Columns'), set: (grid, value) => rearranged(grid, { width: value }), size: true, whole: true },
  { key: 'height', field: 'height', label: mark('Rows'), set: (grid, value) => rearranged(grid, { height: value }), size: true, whole: true },
  { key: 'origin-0', field: 'origin', at: 0, label: mark('Left edge x [m]'), set: (grid, value) => ({ ...grid, origin: [value, grid.origin[1]] }) },
  { key: 'origin-1', field: 'origin', at: 1, label: mark('Lower edge y [m]'), set: (grid, value) => ({ ...grid, origin: [grid.origin[0], value] }) },
];
const HEADING = 'heading';
const PLACING = [
  { key: 'latitude', at: 0, label: mark('Latitude [°]') }, { key: 'longitude', at: 1, label: mark('Longitude [°]') }, { key: HEADING, label: mark('Heading of the y axis [°]') },
];

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
    // -- mouse and fingers ---------------------------------------------------------------
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
      return this.grid.waypoints.findLastIndex((one) => Math.hypot(...this.board.screen([0, 1].map((axis) => this.grid.origin[axis] + (one[axis] + 0.5) * this.grid.resolution)).map((value, axis) => value - from[axis])) < NEAR_PX / 2);
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
    // -- keys ----------------------------------------------------------------------------
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
      const [x, y] = this.board.screen([0, 1].map((axis) => this.grid.origin[axis] + (this.cursor[axis] + 0.5) * this.grid.resolution)), edge = 30;
      this.board.pan(Math.max(0, edge - x) - Math.max(0, x - this.board.width + edge), Math.max(0, edge - y) - Math.max(0, y - this.board.height + edge));
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
