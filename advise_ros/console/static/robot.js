// The drone and its nodes: recording, flying, states.
import { t } from '/console/language.js';

const SIGN = { ok: '●', warn: '▲', error: '✖', silent: '○', gone: '–' };

export default {
  props: { nodes: Array, vehicle: Object, flight: Object, battery: Number, disabled: Boolean },
  emits: ['act'],
  template: `
    <section class="card robot" aria-labelledby="robot-title">
      <h2 id="robot-title">{{ t('Drone') }}</h2>
      <p class="state" data-test="vehicle">{{ vehicleText }}</p>
      <p class="state" v-if="flight && flight.phase !== 'idle'" data-test="flight"><b>{{ phase }}</b>: {{ flight.message || t('step {step} of {most}', { step: flight.steps, most: flight.budget }) }}</p>
      <p class="state" :class="{guard: inFlight}" v-if="guard" data-test="guard"><b>{{ t('Guard:') }}</b> {{ guard }}</p>
      <div class="row">
        <button type="button" :disabled="disabled" @click="$emit('act', 'takeoff')">{{ t('Take off') }}</button>
        <button type="button" :disabled="disabled" @click="$emit('act', 'fly')">{{ t('Fly the policy') }}</button>
        <button type="button" :disabled="disabled" @click="$emit('act', 'land')">{{ t('Land') }}</button>
        <button type="button" v-if="lost" :disabled="disabled" data-test="take-over" @click="$emit('act', 'take_over')">{{ t('Take over') }}</button>
      </div>
      <h3>{{ t('Demonstration') }}</h3>
      <p class="state" v-if="recorder" data-test="recorder">{{ recorder }}</p>
      <div class="row">
        <button type="button" :disabled="disabled" @click="$emit('act', 'record_start')">{{ t('Record') }}</button>
        <button type="button" :disabled="disabled" @click="$emit('act', 'record_stop')">{{ t('Stop') }}</button>
        <button type="button" :disabled="disabled" @click="$emit('act', 'record_discard')">{{ t('Discard') }}</button>
      </div>
      <h3>{{ t('Nodes') }}</h3>
      <ul class="nodes" :aria-label="t('State of every node')">
        <li v-for="node in nodes || []" :key="node.name" :class="node.level">
          <span class="sign" aria-hidden="true">{{ sign(node.level) }}</span><b>{{ node.name }}</b>{{ ' ' }}
          <span :class="{short: node.level === 'ok'}">{{ last(node) }}</span>
        </li>
        <li v-if="!(nodes || []).length" class="silent">{{ t('No node is heard.') }}</li>
      </ul>
    </section>`,
  computed: {
    vehicleText() {
      const v = this.vehicle;
      if (!v) return t('No vehicle is heard.');
      if (!v.connected) return t('No heartbeat of the vehicle.');
      const state = v.in_air ? t('in the air') : v.armed ? t('armed') : t('on the ground');
      return `${v.autopilot} ${v.mode}, ${state}${v.waiting_for ? t('; waiting for {what}', { what: v.waiting_for }) : ''}${v.text ? ` · ${v.text}` : ''}`;
    },
    phase() {
      const phases = {
        'to start': t('on the way to the start'), flying: t('flying'), succeeded: t('arrived'), 'budget spent': t('too many steps'), blocked: t('blocked'),
        canceled: t('cancelled'), stopped: t('stopped'), lost: t('lost'),
      };
      return phases[this.flight.phase] || this.flight.phase;
    },
    lost() { return this.vehicle && this.vehicle.connected && this.vehicle.in_air && this.vehicle.owner === 'others'; },
    // What stops a flight is a fault; a drone that hovers and gets no commands is none.
    inFlight() { return /^(flying|to start)$/.test(this.flight?.phase); },
    guard() { return this.message(['guard', 'mavlink_bridge'], (node) => node.level === 'warn' || node.level === 'error'); },
    recorder() { return this.message(['recorder'], () => true); },
  },
  methods: {
    t,
    sign: (level) => SIGN[level] || '?',
    last(node) {
      if (node.level === 'silent') return t('silent; it said last: {text}', { text: node.message });
      return node.level === 'gone' ? t('has ended; it said last: {text}', { text: node.message }) : node.message;
    },
    message(names, fits) {
      const node = (this.nodes || []).find((one) => names.includes(one.name) && !['silent', 'gone'].includes(one.level) && fits(one));
      return node ? node.message : '';
    },
  },
};
