// Four directions; each is not chosen, right or wrong. A click goes on to the next, Shift with a click says wrong at once.
import { t } from '/console/language.js';
import { actionName } from '/console/words.js';

const PLACE = ['north', 'east', 'south', 'west'];
const GLYPH = ['↑', '→', '↓', '←'];

export default {
  props: { preferred: Array, avoided: Array, assumed: Array, disabled: Boolean },
  emits: ['prefer', 'avoid', 'clear'],
  template: `
    <div class="compass" role="group" :aria-label="t('Directions: which is right, which is wrong')">
      <button v-for="action in 4" :key="action" type="button" :disabled="disabled" :data-action="action - 1"
        :class="['way', place(action - 1), state(action - 1)]" :aria-label="label(action - 1)"
        @click="onClick(action - 1, $event)" @contextmenu.prevent="$emit('avoid', action - 1)">
        <span class="glyph" aria-hidden="true">{{ glyph(action - 1) }}</span>
        <span class="name">{{ actionName(action - 1) }}</span>
        <span class="mark" aria-hidden="true">{{ sign(action - 1) }}</span>
      </button>
    </div>`,
  methods: {
    t, actionName,
    place: (action) => PLACE[action],
    glyph: (action) => GLYPH[action],
    state(action) {
      if (this.preferred.includes(action)) return 'right';
      if (this.avoided.includes(action)) return 'wrong';
      return this.assumed.includes(action) ? 'assumed' : 'open';
    },
    sign(action) { return { right: `✓ ${t('right')}`, wrong: `✕ ${t('wrong')}`, assumed: `✕ ${t('wrong')}?`, open: '' }[this.state(action)]; },
    label(action) {
      const state = { right: t('right'), wrong: t('wrong'), assumed: t('taken as wrong, its opposite is right'), open: t('not chosen') }[this.state(action)];
      const key = [t('arrow up'), t('arrow right'), t('arrow down'), t('arrow left')][action];
      return t('{direction}: {state} (key {key})', { direction: actionName(action), state, key });
    },
    onClick(action, event) {
      if (event.shiftKey) this.$emit('avoid', action);
      else if (this.preferred.includes(action)) this.$emit('avoid', action);
      else if (this.avoided.includes(action)) this.$emit('clear', action);
      else this.$emit('prefer', action);
    },
  },
};
