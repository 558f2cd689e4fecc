// The learnt route as a file for other tools, or onto the vehicle as its mission.
import { t } from '/console/language.js';
import { saveFile } from '/console/save.js';

export default {
  props: { link: Object, delivery: Object, policy: Object, disabled: Boolean },
  emits: ['tell'],
  data: () => ({ sending: false }),
  template: `
    <section class="card delivery" aria-labelledby="delivery-title" v-if="delivery">
      <h2 id="delivery-title">{{ t('Take the route along') }}</h2>
      <p v-if="!delivery.placed" data-test="delivery-why">{{ t('The grid file does not say where it lies on the earth. Add origin_wgs84 to it, and other tools can read the route.') }}</p>
      <div class="row" v-else>
        <button type="button" v-for="form in delivery.forms" :key="form" :disabled="disabled || !policy" :data-test="'route-' + form.slice(1)" @click="save(form)">{{ t('Save {form}', { form }) }}</button>
        <button type="button" v-if="delivery.vehicle" :disabled="disabled || !policy || sending" data-test="route-upload" @click="upload()">{{ sending ? t('Sending the route …') : t('Send to the vehicle as its mission') }}</button>
      </div>
    </section>`,
  methods: {
    t,
    tell(reply) { this.$emit('tell', `${t(reply.message)}.`, !reply.ok); },
    async save(form) {
      const reply = await this.link.send('route_file', { form });
      if (reply.ok) saveFile(reply.text, reply.name, 'text/plain');
      this.tell(reply);
    },
    async upload() {
      this.sending = true;
      const reply = await this.link.send('route_upload', {});
      this.sending = false;
      this.tell(reply);
    },
  },
};
