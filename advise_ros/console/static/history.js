// The answers so far, the newest first: what was said, by whom, what it bought; each can be taken back.
import { percent, t, tn } from '/console/language.js';
import { cells, clock, said } from '/console/words.js';

export default {
  props: { log: Array, gains: Object, contradictions: Array, disabled: Boolean },
  emits: ['retract', 'look'],
  template: `
    <ol class="history" :aria-label="t('Answers so far, the newest first')" reversed>
      <li v-for="entry in entries" :key="entry.id" :class="{gone: entry.retracted, clash: clashes(entry)}"
        @mouseenter="$emit('look', entry)" @mouseleave="$emit('look', null)">
        <div class="what">
          <b>{{ clashes(entry) ? '⚠ ' : '' }}{{ said(entry) }}</b>
          <span>{{ about(entry) }}</span>
          <span v-if="entry.comment" class="comment">“{{ entry.comment }}”</span>
          <span v-if="entry.retracted">{{ bought(entry.back) ? t('taken back, which {bought}', { bought: bought(entry.back) }) : t('taken back') }}</span>
          <span v-else-if="early(entry)">{{ t('what it bought is not known: given before this console was started') }}</span>
          <span v-else-if="bought(entry.entry)" class="gain">{{ bought(entry.entry) }}</span>
        </div>
        <button v-if="!entry.retracted" type="button" class="quiet" :disabled="disabled" :aria-label="t('Take back answer {id}: {said}', { id: entry.id, said: said(entry) })"
          @focus="$emit('look', entry)" @blur="$emit('look', null)" @click="$emit('retract', entry.id)">{{ t('Take back') }}</button>
      </li>
      <li v-if="!entries.length" class="none">{{ t('No answers yet.') }}</li>
    </ol>`,
  computed: { entries() { return [...(this.log || [])].reverse(); } },
  methods: {
    said, t,
    about(entry) {
      const when = this.early(entry) && entry.simulated ? '' : clock(entry.at);
      return [entry.id, t('question {id}', { id: entry.query }), cells(entry.states.length), entry.by || t('someone'), when].filter(Boolean).join(' · ');
    },
    clashes(entry) { return !entry.retracted && (this.contradictions || []).includes(entry.id); },
    early(entry) { return entry.entry <= (this.gains?.since || 0); },
    // Several entries may have been learnt at once: then the gain is that of all of them.
    bought(number) {
      const found = this.early({ entry: number }) ? null : (this.gains?.gains || []).find((one) => one.entry >= number);
      if (!found) return '';
      const gain = tn('changed {n} cell, then {share} expected', 'changed {n} cells, then {share} expected', found.changed, { share: percent(found.success) });
      return found.entry > number ? t('with the next {gain}', { gain }) : gain;
    },
  },
};
