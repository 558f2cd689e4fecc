// Four directions; each is not chosen, right or wrong. A click goes on to the next, Shift with a click says wrong at once.
import { ACTIONS } from '/console/words.js';

const PLACE = ['north', 'east', 'south', 'west'];
const GLYPH = ['↑', '→', '↓', '←'];
const KEY = ['arrow up', 'arrow right', 'arrow down', 'arrow left'];

export default {
  props: { preferred: Array, avoided: Array, assumed: Array, flown: Array, policy: Array, disabled: Boolean },
  emits: ['prefer', 'avoid', 'clear'],
  template: `
    <div class="compass" role="group" aria-label="Directions: which is right, which is wrong">
      <button v-for="action in 4" :key="action" type="button" :disabled="disabled" :data-action="action - 1"
        :class="['way', place(action - 1), state(action - 1)]" :aria-label="label(action - 1)"
        @click="onClick(action - 1, $event)" @contextmenu.prevent="$emit('avoid', action - 1)">
        <span class="glyph" aria-hidden="true">{{ glyph(action - 1) }}</span>
        <span class="name">{{ name(action - 1) }}</span>
        <span class="mark" aria-hidden="true">{{ mark(action - 1) }}</span>
      </button>
      <span class="hub" aria-hidden="true">N<br>W&ensp;E<br>S</span>
    </div>`,
  methods: {
    place: (action) => PLACE[action],
    glyph: (action) => GLYPH[action],
    name: (action) => ACTIONS[action],
    state(action) {
      if (this.preferred.includes(action)) return 'right';
      if (this.avoided.includes(action)) return 'wrong';
      return this.assumed.includes(action) ? 'assumed' : 'open';
    },
    mark(action) { return { right: '✓ right', wrong: '✕ wrong', assumed: '✕ wrong?', open: '' }[this.state(action)]; },
    label(action) {
      const state = { right: 'right', wrong: 'wrong', assumed: 'taken as wrong, its opposite is right', open: 'not chosen' }[this.state(action)];
      return `${ACTIONS[action]}: ${state} (key ${KEY[action]})`;
    },
    onClick(action, event) {
      if (event.shiftKey) this.$emit('avoid', action);
      else if (this.preferred.includes(action)) this.$emit('avoid', action);
      else if (this.avoided.includes(action)) this.$emit('clear', action);
      else this.$emit('prefer', action);
    },
  },
};
