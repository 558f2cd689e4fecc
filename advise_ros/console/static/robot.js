// The drone and its nodes: recording, flying, states.
const SIGN = { ok: '●', warn: '▲', error: '✖', silent: '○', gone: '–' };
const LAST = { silent: 'silent; it said last: ', gone: 'has ended; it said last: ' };

export default {
  props: { nodes: Array, vehicle: Object, flight: Object, battery: Number, disabled: Boolean },
  emits: ['act'],
  template: `
    <section class="card robot" aria-labelledby="robot-title">
      <h2 id="robot-title">Drone</h2>
      <p class="state" data-test="vehicle">{{ vehicleText }}</p>
      <p class="state" v-if="flight && flight.phase !== 'idle'" data-test="flight"><b>{{ flight.phase }}</b>: {{ flight.message || ('step ' + flight.steps + ' of ' + flight.budget) }}</p>
      <p class="state guard" v-if="guard" data-test="guard"><b>Guard:</b> {{ guard }}</p>
      <div class="row">
        <button type="button" :disabled="disabled" @click="$emit('act', 'takeoff')">Take off</button>
        <button type="button" :disabled="disabled" @click="$emit('act', 'fly')">Fly the policy</button>
        <button type="button" :disabled="disabled" @click="$emit('act', 'land')">Land</button>
        <button type="button" v-if="lost" :disabled="disabled" data-test="take-over" @click="$emit('act', 'take_over')">Take over</button>
      </div>
      <h3>Demonstration</h3>
      <p class="state" v-if="recorder" data-test="recorder">{{ recorder }}</p>
      <div class="row">
        <button type="button" :disabled="disabled" @click="$emit('act', 'record_start')">Record</button>
        <button type="button" :disabled="disabled" @click="$emit('act', 'record_stop')">Stop</button>
        <button type="button" :disabled="disabled" @click="$emit('act', 'record_discard')">Discard</button>
      </div>
      <h3>Nodes</h3>
      <ul class="nodes" aria-label="State of every node">
        <li v-for="node in nodes || []" :key="node.name" :class="node.level">
          <span class="sign" aria-hidden="true">{{ sign(node.level) }}</span><b>{{ node.name }}</b>{{ ' ' }}
          <span :class="{short: node.level === 'ok'}">{{ last(node.level) }}{{ node.message }}</span>
        </li>
        <li v-if="!(nodes || []).length" class="silent">No node is heard.</li>
      </ul>
    </section>`,
  computed: {
    vehicleText() {
      const v = this.vehicle;
      if (!v) return 'No vehicle is heard.';
      if (!v.connected) return 'No heartbeat of the vehicle.';
      const state = v.in_air ? 'in the air' : v.armed ? 'armed' : 'on the ground';
      return `${v.autopilot} ${v.mode}, ${state}${v.waiting_for ? `; waiting for ${v.waiting_for}` : ''}${v.text ? ` · ${v.text}` : ''}`;
    },
    lost() { return this.vehicle && this.vehicle.connected && this.vehicle.in_air && this.vehicle.owner === 'others'; },
    guard() { return this.message(['guard', 'mavlink_bridge'], (node) => node.level === 'warn' || node.level === 'error'); },
    recorder() { return this.message(['recorder'], () => true); },
  },
  methods: {
    sign: (level) => SIGN[level] || '?',
    last: (level) => LAST[level] || '',
    message(names, fits) {
      const node = (this.nodes || []).find((one) => names.includes(one.name) && !LAST[one.level] && fits(one));
      return node ? node.message : '';
    },
  },
};
