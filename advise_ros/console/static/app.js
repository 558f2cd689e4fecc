// The page: what the drone asks, the map, the answer, and the drone itself.
import Compass from '/console/compass.js';
import GridMap from '/console/map.js';
import History from '/console/history.js';
import Robot from '/console/robot.js';
import Teach from '/console/teach.js';
import Delivery from '/console/delivery.js';
import { Link } from '/console/link.js';
import { choose as chooseLanguage, language, number, percent, speak, t, tn } from '/console/language.js';
import template from '/console/template.js';
import { layerViews, describe } from '/console/layers.js';
import { KEYS, keyAct, letGo } from '/console/keys.js';
import { ANSWER, CONTRADICTION, MIXED, SKIP, SPLIT, UNSURE, assumed, cells as cellsOf, names, reached, said, steps } from '/console/words.js';

const PREVIEW_AFTER_MS = 250, LOOK_MS = 100, STALE_MS = 4000, NOTE_MS = 12000, TRACK_POINTS = 300;
const MOMENT_CELLS_A_SECOND = 3.5;
// Per cent from which on a cell is likely to be kept out of.
const LIKELY = 50;
const CALM = matchMedia('(prefers-reduced-motion: reduce)');

export default {
  components: { Compass, Delivery, GridMap, History, Robot, Teach },
  props: { start: Object, words: Object, window: String },
  template,
  data() {
    return {
      s: {}, up: false, met: false, stale: false, people: 1, kept: [], preferred: [], avoided: [], comment: '', by: localStorage.getItem('advise-name') || '',
      theme: localStorage.getItem('advise-theme') || 'auto', systemDark: matchMedia('(prefers-color-scheme: dark)').matches,
      layer: 0, show: { unsure: false, keepOut: true, flown: true, policy: true, route: true }, preview: null, previewing: false, clash: null, note: null,
      considered: -1, named: false, drawing: false, part: new Set(), cursor: -1, looked: null, replaying: -1, help: false, sent: 0, reasons: false, marks: matchMedia('(min-width: 1100px)').matches,
    };
  },
  computed: {
    language: () => language,
    keys: () => KEYS,
    map() { return this.s.map; },
    query() { return this.s.query && this.s.query.id ? this.s.query : null; },
    // Answers of one gesture, the one that keeps out first.
    options() { return this.query?.options || []; },
    // Directions are named: the cells that they are for are marked.
    byDirections() { return !this.options.length || this.named || this.drawing || this.preferred.length > 0 || this.avoided.length > 0; },
    entersNow() { const likely = this.s.site?.keepOut; return likely && this.s.policy ? this.s.policy.route.filter((state) => likely[state % likely.length] >= LIKELY).length : -1; },
    learner() { return this.s.learner || { phase: 'silent', message: '', contradictions: [] }; },
    sending() { return Boolean(this.query) && this.sent === this.query.id; },
    open() { return Boolean(this.query) && this.learner.phase !== 'learning' && !this.answered; },
    answered() { return this.query && (this.s.log || []).some((entry) => entry.query === this.query.id && !entry.retracted); },
    dark() { return this.theme === 'dark' || (this.theme === 'auto' && this.systemDark); },
    wrong() { return this.avoided.length ? this.avoided : assumed(this.preferred); },
    assumedWrong() { return this.avoided.length || !this.preferred.length ? [] : assumed(this.preferred); },
    isReady() { return this.drawing ? this.part.size > 0 && this.part.size < this.query?.states.length : this.preferred.length > 0 && this.wrong.length > 0; },
    sentence() {
      if (!this.byDirections) return '';
      if (this.drawing) {
        return this.part.size ? tn('You say: {n} of {cells} goes another way than the rest.', 'You say: {n} of {cells} go another way than the rest.', this.part.size, { cells: cellsOf(this.query.states.length) })
          : t('Mark the cells that go another way than the rest.');
      }
      const right = names(this.preferred), wrong = names(this.wrong);
      if (!this.preferred.length) return this.avoided.length ? tn('You say: {wrong} is wrong. Which direction is right?', 'You say: {wrong} are wrong. Which direction is right?', this.avoided.length, { wrong }) : t('Choose the right direction.');
      return tn('You say: {right} is right, not {wrong}.', 'You say: {right} are right, not {wrong}.', this.preferred.length, { right, wrong });
    },
    before() {
      if (!this.query) return [];
      const asked = new Set(this.query.states);
      return (this.s.log || []).filter((entry) => !entry.retracted && entry.verdict === ANSWER && entry.states.some((state) => asked.has(state)));
    },
    // The question in a few words, its reasons, and head and tail of each answer; a text without words of ours stays as it came.
    asking() {
      const given = this.query?.said?.[language.code];
      if (given) return given;
      if (!this.query) return { short: this.standing, why: [], options: [] };
      const [short, ...why] = this.query.question.split(/(?<=[?.])\s+/);
      return { short, why, options: this.options.map((option) => option.label.split(': ')) };
    },
    // Where the learner stands while it asks nothing.
    standing() {
      const { phase, enough, message } = this.learner;
      if (phase === 'silent') return t('No learner is heard yet.');
      if (phase === 'learning') return t('The drone is learning …');
      if (enough) return t('I would fly it now: no answer would change much.');
      if (phase === 'waiting') return t('Waiting for flights. Fly the route once or twice; each flight is a demonstration.');
      return phase === 'done' ? t('No question is left. Fly the policy, or fly another demonstration.') : message;
    },
    stepsSaved() { return tn('{n} step', '{n} steps', Math.round(10 * this.query.worth) / 10, { n: number(this.query.worth, 1) }); },
    themeName() { return { auto: t('automatic'), dark: t('dark'), light: t('light') }[this.theme]; },
    progress() {
      const parts = [tn('{n} answer given', '{n} answers given', this.learner.answers || 0)], policy = this.s.policy;
      if (policy) parts.push(t('{n} of {all} waypoints reached', { n: policy.waypoints, all: this.map?.layers }), t('expected success {share}', { share: percent(policy.success) }));
      if (policy && this.entersNow >= 0) parts.push(tn('{n} keep-out cell crossed', '{n} keep-out cells crossed', this.entersNow));
      return parts.join(' · ');
    },
    previewText() {
      const p = this.preview;
      if (this.previewing || !p) return ['', t('Trying it out …')];
      if (!p.ok) return ['', p.message];
      const before = reached(p.before, this.map, p.reaches[0]), after = reached(p.after, this.map, p.reaches[1]);
      const gains = [t('waypoints reached {before} → {after} of {all}', { before, after, all: this.map.layers })];
      if (p.keepOut.length) gains.unshift(t('keep-out cells crossed {before} → {after}', { before: p.entered[0].length, after: p.entered[1].length }));
      const changes = p.changed.length ? tn('▲ {n} cell would change', '▲ {n} cells would change', p.changed.length) : t('nothing would change');
      const better = Math.abs(p.success[1] - p.success[0]) >= 0.01 ? t('; expected success {before} → {after}', { before: percent(p.success[0]), after: percent(p.success[1]) }) : '';
      return [gains.join(', '), `${changes}${better}.`];
    },
    worse() {
      const p = this.preview;
      return Boolean(p) && (!p.ok || p.success[1] < p.success[0] - 0.005 || p.entered[1].length > p.entered[0].length);
    },
    clashing() {
      const held = (this.s.log || []).filter((entry) => !entry.retracted), ids = this.clash ? this.clash.ids : this.preview?.contradicts || [];
      if (this.clash?.soft && !held.some((entry) => entry.id === this.clash.mine)) return [];
      return held.filter((entry) => ids.includes(entry.id));
    },
    // Where the contradiction is: in the cells of this question, or of the answer that was given in spite of it.
    clashCells() {
      const mine = this.clash?.soft ? this.ours() : this.query, ours = new Set(mine?.states || []);
      return this.clashing.flatMap((entry) => entry.states.filter((state) => ours.has(state)));
    },
    layers() { return this.map ? layerViews(this) : []; },
    order() {
      const asked = (layer) => this.layers[layer]?.asked.size || 0;
      return [...this.layers.keys()].sort((a, b) => (asked(b) > 0) - (asked(a) > 0) || a - b);
    },
    mapLabel() { return this.map ? describe(this, this.layer) : t('No map yet'); },
    alarm() {
      if (this.cutOff) return t('No connection to the console. The page tries again by itself; an answer that you give now is kept and sent once.');
      const graph = this.s.graph;
      if (graph && !graph.learner) return graph.heard ? t('The learner is silent. An answer that you give now is kept and sent once when it is back.') : t('No learner is heard yet; start it, or wait.');
      return '';
    },
    troubled() { return (this.s.nodes || []).filter((node) => node.level === 'error' || node.level === 'silent'); },
    // Acts arrive; until the line is up for the first time the page is on its way, not cut off.
    canCommand() { return this.up && !this.stale; },
    canTry() { return this.canCommand && Boolean(this.s.graph?.learner); },
    cutOff() { return !this.canCommand && (this.met || this.stale); },
    line() { return this.canCommand ? `● ${t('live')}` : this.cutOff ? `○ ${t('cut off')}` : `… ${t('connecting')}`; },
    status() {
      if (this.learner.phase === 'learning') return t('The drone is learning …');
      if (this.sending) return t('Your answer is on the way …');
      if (this.query && this.open) return t('The drone asks: question {id}', { id: this.query.id });
      return this.query && this.answered ? t('Question {id} is answered; the drone is learning …', { id: this.query.id }) : this.standing;
    },
  },
  watch: {
    'query.id'(now, before) { if (before !== undefined || now) this.onQuestion(); },
    // A contradiction is shown where it is, and then the question again.
    clashing(now, before) {
      if (now.length) this.showClash();
      else if (before.length && !this.layers[this.layer]?.asked.size) this.showQuestion();
    },
    dark: { immediate: true, handler(dark) { document.documentElement.dataset.theme = dark ? 'dark' : 'light'; } },
    theme(theme) { localStorage.setItem('advise-theme', theme); },
    by(by) { localStorage.setItem('advise-name', by); },
    canTry(now) { if (now && !this.preview) this.askPreview(); },
    preferred() { this.askPreview(); },
    avoided() { this.askPreview(); },
  },
  created() {
    speak(this.words);
    this.moving = { drone: null, track: [], moment: null };
    this.link = new Link((...args) => this.$emit(...args), (answers) => { this.kept = answers; });
    this.kept = this.link.answers;
    this.heard = performance.now();
    this.take(this.start || {}, 1);
  },
  mounted() {
    document.title = 'advise';
    this.timer = setInterval(() => this.look(), LOOK_MS);
    document.addEventListener('keydown', (event) => keyAct(this, event));
    document.addEventListener('click', letGo);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', (event) => { this.systemDark = event.matches; });
    this.frame();
  },
  methods: {
    t, tn, chooseLanguage, cellsOf, number, percent, said, steps,
    // -- from the server -----------------------------------------------------------------
    take(sections, people) {
      this.heard = performance.now();
      this.people = people;
      const { drone, track, ...rest } = sections;
      if (track) this.moving.track = track.slice();
      if (drone) this.fly(drone);
      for (const [name, value] of Object.entries(rest)) this.s[name] = Object.freeze(value);
    },
    reply(id, reply) { this.link.reply(id, reply); },
    welcome(line) { this.link.welcome(line); this.look(); },
    fly(drone) {
      this.moving.drone = drone;
      this.$refs.teach?.move(drone);
      const track = this.moving.track, last = track[track.length - 1], step = 0.1 * (this.map?.resolution || 1);
      if (!last || Math.hypot(last[0] - drone[0], last[1] - drone[1]) >= step) track.push([drone[0], drone[1]]);
      if (track.length > TRACK_POINTS) track.shift();
      this.moved = true;
    },
    look() {
      this.up = this.link.look();
      this.met = this.met || this.up;
      this.stale = performance.now() - this.heard > STALE_MS;
    },
    frame() {
      if (this.moved || this.moving.moment) {
        this.moved = false;
        this.advance();
        this.$refs.map?.move(this.moving);
      }
      requestAnimationFrame(() => this.frame());
    },
    // -- the question --------------------------------------------------------------------
    onQuestion() {
      this.preferred = []; this.avoided = []; this.comment = ''; this.preview = null; this.clash = this.clash?.soft ? this.clash : null;
      this.drawing = this.named = false; this.considered = -1; this.part = new Set(); this.cursor = -1; this.stopReplay();
      this.showQuestion();
      this.$nextTick(() => this.$refs.map?.follow());
    },
    // The map with most of its cells.
    showQuestion() {
      if (!this.query || !this.map) return;
      const size = this.map.width * this.map.height, hits = Array(this.map.layers).fill(0);
      for (const state of this.query.states) hits[Math.floor(state / size)]++;
      this.layer = hits.indexOf(Math.max(...hits));
    },
    prefer(action) {
      this.avoided = this.avoided.filter((one) => one !== action);
      this.preferred = this.preferred.includes(action) ? this.preferred.filter((one) => one !== action) : [...this.preferred, action].sort();
    },
    avoid(action) {
      this.preferred = this.preferred.filter((one) => one !== action);
      this.avoided = this.avoided.includes(action) ? this.avoided.filter((one) => one !== action) : [...this.avoided, action].sort();
    },
    clear(action) {
      this.preferred = this.preferred.filter((one) => one !== action);
      this.avoided = this.avoided.filter((one) => one !== action);
    },
    avoidOthers() { this.avoided = [0, 1, 2, 3].filter((action) => !this.preferred.includes(action)); },
    given(verdict, option = this.options[this.considered]) {
      const said = verdict === ANSWER, { preferred, avoided } = option || { preferred: this.preferred, avoided: this.wrong };
      return {
        query: this.query.id, states: this.query.states, verdict, preferred: said ? preferred : [], avoided: said ? avoided : [],
        part: verdict === SPLIT ? this.partStates() : [], by: this.by.trim(), comment: this.comment.trim() || (said && option ? option.label : ''),
      };
    },
    // Look at what an answer of one gesture would change; -1: at none.
    consider(index) {
      if (this.considered === index || this.sending) return;
      this.considered = index;
      this.askPreview();
    },
    choose(index) {
      if (!this.options[index] || !this.open) return;
      this.drawing = false;
      this.give(ANSWER, this.options[index]);
    },
    askPreview() {
      clearTimeout(this.previewTimer);
      this.preview = null;
      if (this.clash && !this.clash.soft) this.clash = null;
      const picked = this.considered >= 0 || (this.preferred.length && this.wrong.length);
      if (this.open && picked && this.canTry) this.previewTimer = setTimeout(() => this.fetchPreview(), PREVIEW_AFTER_MS);
      else this.previewing = false;
    },
    async fetchPreview() {
      const given = this.given(ANSWER), key = JSON.stringify(given);
      this.previewing = true;
      const reply = await this.link.send('preview', given);
      if (!this.query || JSON.stringify(this.given(ANSWER)) !== key) return;
      this.previewing = false;
      this.preview = reply;
    },
    ours() { return (this.s.log || []).find((entry) => entry.id === this.clash?.mine); },
    clashElsewhere() { return this.clashCells.length > 0 && !this.layers[this.layer]?.clash.size; },
    showClash() { if (this.clashElsewhere()) this.layer = this.layers.findIndex((view) => view.clash.size); },
    async send() {
      if (!this.isReady || !this.query || this.answered) return;
      await this.give(this.drawing ? SPLIT : ANSWER);
    },
    async give(verdict, option = null) {
      if (!this.query || this.answered || this.sending) return;
      this.considered = -1;
      const given = this.given(verdict, option), picks = [this.preferred, this.avoided];
      this.sent = given.query;
      const waiting = setTimeout(() => { this.tell(t('Your answer is kept; it is sent when the learner is back.')); }, 1500);
      const reply = await this.link.answer(given);
      clearTimeout(waiting);
      if (this.sent === given.query) this.sent = 0;
      this.onGiven(given, reply, picks);
    },
    onGiven(given, reply, picks) {
      const refused = reply.code === CONTRADICTION;
      if (reply.contradicts?.length) this.clash = { ids: reply.contradicts, mine: reply.advice, soft: !refused };
      if (reply.ok) this.tell(reply.contradicts?.length ? t('Answer {id} is noted, though it contradicts an earlier one.', { id: reply.advice }) : reply.advice ? t('Thank you: answer {id} is noted.', { id: reply.advice }) : t('Thank you: {message}.', { message: reply.message }));
      else this.tell(t('Not taken: {message}.', { message: reply.message }), true);
      if (!reply.ok && this.query?.id === given.query && given.verdict === ANSWER) [this.preferred, this.avoided] = picks;
    },
    skip() { this.give(SKIP); },
    unsure() { this.give(UNSURE); },
    mixed() {
      if (!this.open) return;
      this.stopReplay();
      this.drawing = !this.drawing;
      this.part = new Set();
      this.cursor = this.drawing ? this.cells()[0] ?? -1 : -1;
      this.preferred = []; this.avoided = [];
      if (this.drawing) this.showMap();
    },
    splitItself() { this.drawing = false; this.part = new Set(); this.cursor = -1; this.give(MIXED); },
    cells() { return [...(this.layers[this.layer]?.asked || [])]; },
    // The part is kept as states, so that it may lie in several layers.
    mark(cell, on) {
      const size = this.map.width * this.map.height, state = this.layer * size + cell;
      if (!this.query || !this.query.states.includes(state)) return;
      const part = new Set(this.part);
      if (on ?? !part.has(state)) part.add(state); else part.delete(state);
      this.part = part;
      this.cursor = cell;
    },
    partStates() { return [...this.part].sort((a, b) => a - b); },
    // -- acts ----------------------------------------------------------------------------
    async act(name, given = {}) {
      const reply = await this.link.send(name, given);
      const what = {
        hold: t('HOLD'), fly: t('Fly the policy'), takeoff: t('Take off'), land: t('Land'), take_over: t('Take over'), undo: t('Take back'), retract: t('Take back'),
        record_start: t('Record'), record_stop: t('Stop'), record_discard: t('Discard'),
      }[name];
      this.tell(`${what}: ${reply.message}${/[.?!]$/.test(reply.message) ? '' : '.'}`, !reply.ok);
      return reply;
    },
    async retract(advice) {
      const reply = await this.act('retract', { advice });
      if (reply.ok && this.clash) this.clash = null;
      if (reply.ok) this.askPreview();
    },
    clearPicks() {
      if (this.drawing) this.mixed();
      else { this.preferred = []; this.avoided = []; }
    },
    tell(text, bad = false) {
      this.note = { text, bad };
      clearTimeout(this.noteTimer);
      this.noteTimer = setTimeout(() => { this.note = null; }, NOTE_MS);
    },
    nextTheme() { this.theme = { auto: 'dark', dark: 'light', light: 'auto' }[this.theme]; },
    overlap(entry) {
      const asked = new Set(this.query?.states || []);
      return entry.states.filter((state) => asked.has(state)).length;
    },
    // -- replay of the flown moments ------------------------------------------------------
    replay() {
      if (this.replaying >= 0) return this.stopReplay();
      if (!this.query?.moments.length) return;
      this.layerBefore = this.layer;
      this.startMoment(0);
      this.showMap();
    },
    showMap() { this.$refs.map?.$el.scrollIntoView({ block: 'nearest', behavior: CALM.matches ? 'auto' : 'smooth' }); },
    startMoment(index) {
      const moment = this.query.moments[index];
      this.replaying = index;
      this.layer = moment.layer;
      this.moving.moment = { cells: moment.cells, done: 0, began: performance.now() };
    },
    advance() {
      const moment = this.moving.moment;
      if (!moment) return;
      const flown = (performance.now() - moment.began) / 1000 * MOMENT_CELLS_A_SECOND;
      moment.done = CALM.matches ? moment.cells.length : flown; // Who wants no motion sees the whole way, for as long.
      if (flown < moment.cells.length) return;
      if (this.query && this.replaying + 1 < this.query.moments.length) this.startMoment(this.replaying + 1);
      else this.stopReplay();
    },
    // The map is again the one that was looked at.
    stopReplay() {
      if (this.replaying < 0) return;
      this.layer = this.layerBefore;
      this.replaying = -1; this.moving.moment = null; this.moved = true;
    },
  },
};
