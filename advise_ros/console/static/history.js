// The answers so far, the newest first: what was said, by whom, what it bought; each can be taken back.
import { clock, count, percent, said } from '/console/words.js';

export default {
  props: { log: Array, gains: Object, contradictions: Array, disabled: Boolean },
  emits: ['retract', 'look'],
  template: `
    <ol class="history" aria-label="Answers so far, the newest first" reversed>
      <li v-for="entry in entries" :key="entry.id" :class="{gone: entry.retracted, clash: clashes(entry)}"
        @mouseenter="$emit('look', entry)" @mouseleave="$emit('look', null)">
        <div class="what">
          <b>{{ clashes(entry) ? '⚠ ' : '' }}{{ said(entry) }}</b>
          <span>{{ entry.id }} · question {{ entry.query }} · {{ count(entry.states.length, 'cell') }} · {{ entry.by || 'someone' }} {{ clock(entry.at) }}</span>
          <span v-if="entry.comment" class="comment">“{{ entry.comment }}”</span>
          <span v-if="entry.retracted">taken back{{ bought(entry.back) ? ', which ' + bought(entry.back) : '' }}</span>
          <span v-else-if="early(entry)">what it bought is not known: given before this console was started</span>
          <span v-else-if="bought(entry.entry)" class="gain">{{ bought(entry.entry) }}</span>
        </div>
        <button v-if="!entry.retracted" type="button" class="quiet" :disabled="disabled" :aria-label="'Take back answer ' + entry.id + ': ' + said(entry)"
          @focus="$emit('look', entry)" @blur="$emit('look', null)" @click="$emit('retract', entry.id)">Take back</button>
      </li>
      <li v-if="!entries.length" class="none">No answers yet.</li>
    </ol>`,
  computed: { entries() { return [...(this.log || [])].reverse(); } },
  methods: {
    said, clock, count,
    clashes(entry) { return !entry.retracted && (this.contradictions || []).includes(entry.id); },
    early(entry) { return entry.entry <= (this.gains?.since || 0); },
    // Several entries may have been learnt at once: then the gain is that of all of them.
    bought(number) {
      const found = this.early({ entry: number }) ? null : (this.gains?.gains || []).find((one) => one.entry >= number);
      return found ? `${found.entry > number ? 'with the next ' : ''}changed ${count(found.changed, 'cell')}, then ${percent(found.success)} expected` : '';
    },
  },
};
