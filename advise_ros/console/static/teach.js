// Teaching: a person flies by keys, touch sticks or a gamepad, and sees what was taught.
import { number, t, tn } from '/console/language.js';
import { saveFile } from '/console/save.js';
import { fold, gamepadStick, keyStick, lengthOf, outsideBy, strongest } from '/console/stick.js';

const SEND_MS = 80, PLAY_CELLS_A_SECOND = 4;
const SIMULATED_S = 365 * 86400;

export default {
  props: { link: Object, window: String, hand: Object, lessons: Array, map: Object, vehicle: Object, disabled: Boolean },
  emits: ['tell', 'act'],
  data() { return { keys: new Set(), pad: [0, 0], lever: 0, paused: false, outside: null, at: null, gamepad: null, playing: null, naming: null, newName: null }; },
  template: `
    <section class="card teach" aria-labelledby="teach-title" data-test="teach">
      <h2 id="teach-title">{{ t('Teach') }}</h2>
      <p class="state" data-test="hand">{{ state }}</p>
      <p class="outside" role="alert" v-if="outside" data-test="outside">⚠ {{ outside }}</p>
      <div class="row">
        <button type="button" v-if="!flies" :disabled="disabled" data-test="hand-take" @click="take()">{{ t('Fly by hand') }}</button>
        <button type="button" v-if="flies" data-test="hand-release" @click="release()">{{ t('Let go') }}</button>
        <button type="button" v-if="flies" :aria-pressed="String(paused)" data-test="hand-pause" @click="pause()">{{ paused ? t('Resume') : t('Pause') }}</button>
      </div>
      <div class="sticks" v-if="flies">
        <div class="stickpad" role="img" :aria-label="t('Touch stick: north is up')" data-test="stickpad" @pointerdown="touch" @pointermove="touch" @pointerup="letGo" @pointercancel="letGo">
          <i class="knob" :style="{left: 50 + 40 * pad[0] + '%', top: 50 - 40 * pad[1] + '%'}"></i>
        </div>
        <div class="row levers">
          <button type="button" @pointerdown="lever = 1" @pointerup="lever = 0" @pointerleave="lever = 0" @pointercancel="lever = 0">{{ t('Climb') }}</button>
          <button type="button" @pointerdown="lever = -1" @pointerup="lever = 0" @pointerleave="lever = 0" @pointercancel="lever = 0">{{ t('Sink') }}</button>
        </div>
        <p class="hint">{{ t('Arrow keys fly while they are held, Page Up and Page Down climb and sink, Space holds.') }} <span v-if="gamepad" data-test="gamepad">{{ t('Gamepad: {name}', { name: gamepad }) }}</span></p>
      </div>
      <svg v-if="map && (flies || playing)" class="around" :viewBox="viewBox" role="img" :aria-label="t('The grid and the drone, with what lies around')">
        <rect class="ground" x="0" y="0" :width="map.width" :height="map.height"></rect>
        <polyline v-if="playing" class="way" :points="points(playing.cells.slice(0, playing.shown))"></polyline>
        <circle v-for="cell in map.waypoints" :key="cell" class="goal" :cx="centre(cell)[0]" :cy="centre(cell)[1]" r="0.25"></circle>
        <circle v-if="at" class="craft" :class="{out: outside}" :cx="at[0]" :cy="at[1]" r="0.35" data-test="craft"></circle>
      </svg>
      <h3>{{ tn('{n} demonstration', '{n} demonstrations', (lessons || []).length) }}</h3>
      <ul class="lessons" :aria-label="t('Demonstrations')">
        <li v-for="lesson in lessons || []" :key="lesson.id" :data-test="'lesson-' + lesson.id">
          <svg v-if="map" :viewBox="'0 0 ' + map.width + ' ' + map.height" role="img" :aria-label="t('The way of {name}', { name: lesson.name || lesson.id })"><rect class="ground" x="0" y="0" :width="map.width" :height="map.height"></rect><polyline class="way" :points="points(lesson.cells)"></polyline></svg>
          <div class="about">
            <b>{{ lesson.name || lesson.id }}</b> <small>{{ tn('{n} move', '{n} moves', lesson.moves) }} · {{ duration(lesson) }} · {{ t(lesson.end) }}<template v-if="date(lesson)"> · {{ date(lesson) }}</template></small>
            <form v-if="naming === lesson.id" @submit.prevent="rename(lesson)"><input v-model="newName" :aria-label="t('Name')" maxlength="60"><button type="submit">{{ t('Save') }}</button></form>
            <div class="row" v-else>
              <button type="button" class="quiet" @click="play(lesson)">{{ playing && playing.id === lesson.id ? t('■ stop') : t('▶ replay') }}</button>
              <button type="button" class="quiet" :disabled="disabled" @click="naming = lesson.id; newName = lesson.name">{{ t('Rename') }}</button>
              <button type="button" class="quiet" :disabled="disabled" @click="discard(lesson)">{{ t('Discard') }}</button>
            </div>
          </div>
        </li>
      </ul>
      <button type="button" v-if="(lessons || []).length" :disabled="disabled" data-test="download" @click="download()">{{ t('Download demonstrations.json') }}</button>
    </section>`,
  computed: {
    flies() { return Boolean(this.hand && this.hand.window && this.hand.window === this.window); },
    state() {
      if (this.hand?.window && !this.flies) return t('Another window flies.');
      if (!this.flies) return t('Fly the route yourself: take off, then fly by hand. A demonstration ends at the last waypoint or the landing.');
      if (!this.vehicle?.commandable) return t('You have the stick. Take off first.');
      return this.paused ? t('Paused: the drone stands, the demonstration goes on when you resume.') : t('You fly.');
    },
    viewBox() { const m = this.map; return `${-m.width / 4} ${-m.height / 4} ${m.width * 1.5} ${m.height * 1.5}`; },
  },
  watch: {
    flies(now) { if (!now) { this.keys.clear(); this.pad = [0, 0]; this.lever = 0; this.paused = false; } },
  },
  mounted() {
    this.timer = setInterval(() => this.tick(), SEND_MS);
    this.listeners = [
      [document, 'keydown', (event) => this.key(event, true)],
      [document, 'keyup', (event) => this.key(event, false)],
      [window, 'blur', () => this.keys.clear()],
      [document, 'visibilitychange', () => { if (document.hidden && this.flies) this.release(); }],
    ];
    for (const [target, name, act] of this.listeners) target.addEventListener(name, act, true);
  },
  unmounted() {
    clearInterval(this.timer);
    for (const [target, name, act] of this.listeners) target.removeEventListener(name, act, true);
  },
  methods: {
    t, tn,
    // Where the drone is, from the page: cells east and north of the lower left corner.
    move(drone) {
      if (!this.map) return;
      const [x, y] = [(drone[0] - this.map.origin[0]) / this.map.resolution, (drone[1] - this.map.origin[1]) / this.map.resolution];
      this.at = [Math.min(Math.max(x, -this.map.width / 4 + 0.4), this.map.width * 1.25 - 0.4), this.map.height - Math.min(Math.max(y, -this.map.height / 4 + 0.4), this.map.height * 1.25 - 0.4)];
      const away = outsideBy(x, y, this.map);
      this.outside = away && this.vehicle?.in_air ? t('The drone is outside the grid, {far} m {side} of it: such moves teach nothing. Fly back.', { far: number(away.cells * this.map.resolution, 1), side: t(away.side) }) : null;
    },
    async send(name, given = {}) {
      const reply = await this.link.send(name, given);
      this.$emit('tell', `${t(reply.message)}.`, !reply.ok);
      return reply;
    },
    take() { this.paused = false; this.send('hand_take'); },
    release() { this.send('hand_release'); },
    pause() { this.paused = !this.paused; this.keys.clear(); this.pad = [0, 0]; },
    // -- what is held --------------------------------------------------------------------
    key(event, down) {
      if (!this.flies || event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.('input')) return;
      const direction = keyStick(event.key);
      if (!direction) return;
      event.preventDefault();
      event.stopImmediatePropagation(); // It answers no question.
      if (down) this.keys.add(event.key); else this.keys.delete(event.key);
    },
    touch(event) {
      if (event.type === 'pointermove' && !event.buttons) return;
      event.currentTarget.setPointerCapture(event.pointerId);
      const box = event.currentTarget.getBoundingClientRect();
      const clip = (value) => Math.min(Math.max(value, -1), 1);
      this.pad = [clip((event.clientX - box.left) / box.width * 2.5 - 1.25), clip(1.25 - (event.clientY - box.top) / box.height * 2.5)];
    },
    letGo() { this.pad = [0, 0]; },
    tick() {
      if (!this.flies) return;
      const found = [...(navigator.getGamepads?.() || [])].find((one) => one && one.connected);
      this.gamepad = found?.id;
      const pressed = found ? gamepadStick(found) : { stick: [0, 0, 0], hold: false };
      if (pressed.hold) { this.$emit('act', 'hold'); return; }
      const stick = this.paused ? [0, 0, 0] : strongest([pressed.stick, [...this.pad, this.lever], fold([...this.keys].map(keyStick))]);
      if (this.link.up && this.link.open() === this.link.line) this.link.emit('stick', { stick, at: performance.now() / 1000 });
    },
    // -- the list ------------------------------------------------------------------------
    centre(cell) { return [(cell % this.map.width) + 0.5, this.map.height - Math.floor(cell / this.map.width) - 0.5]; },
    points(cells) { return cells.map((cell) => this.centre(cell).join(',')).join(' '); },
    duration(lesson) { return lengthOf(lesson.seconds); },
    date(lesson) { return lesson.at > SIMULATED_S ? new Date(1000 * lesson.at).toLocaleString([], { dateStyle: 'medium', timeStyle: 'short' }) : ''; },
    async rename(lesson) {
      const reply = await this.send('lesson_name', { demonstration: lesson.id, name: this.newName });
      if (reply.ok) this.naming = null;
    },
    discard(lesson) { this.send('lesson_discard', { demonstration: lesson.id }); },
    play(lesson) {
      const stop = this.playing?.id === lesson.id;
      clearInterval(this.player);
      this.playing = stop ? null : { id: lesson.id, cells: lesson.cells, shown: matchMedia('(prefers-reduced-motion: reduce)').matches ? lesson.cells.length : 1 };
      if (stop) return;
      this.player = setInterval(() => {
        if (!this.playing || this.playing.shown >= this.playing.cells.length) { clearInterval(this.player); return; }
        this.playing.shown += 1;
      }, 1000 / PLAY_CELLS_A_SECOND);
    },
    async download() {
      const reply = await this.link.send('lessons_file', {});
      if (!reply.ok) { this.$emit('tell', `${t(reply.message)}.`, true); return; }
      saveFile(reply.text, 'demonstrations.json', 'application/json');
    },
  },
};
