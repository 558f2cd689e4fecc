// Acts of the person on their way: an answer is kept until the server has replied to it, over losses and reloads;
// everything else is refused while there is no connection, so that no old wish to fly is carried out later.
import { newId } from '/console/words.js';

const STORE = 'advise-answers';

export class Link {
  constructor(emit, changed) {
    this.emit = emit;
    this.changed = changed;
    this.up = false;
    this.waiting = new Map();
    this.number = 0;
    this.answers = this.load();
  }

  load() {
    try { return JSON.parse(sessionStorage.getItem(STORE)) || []; } catch { return []; }
  }

  save() {
    sessionStorage.setItem(STORE, JSON.stringify(this.answers));
    this.changed(this.answers);
  }

  // Called twice a second: after a loss everything is asked for anew.
  look() {
    const up = Boolean(window.socket?.connected && window.did_handshake);
    if (up && !this.up) {
      this.emit('hello');
      this.up = true;
      for (const given of this.answers) this.send('answer', given);
    }
    this.up = up;
    return up;
  }

  send(name, given) {
    const id = ++this.number;
    const reply = new Promise((resolve) => this.waiting.set(id, { name, given, resolve }));
    if (window.socket?.connected && window.did_handshake) this.emit('act', { id, name, given });
    else if (name !== 'answer') this.reply(id, { ok: false, message: 'there is no connection to the console; nothing was done' });
    return reply;
  }

  answer(given) {
    const kept = { uid: newId(), ...given };
    this.answers = [...this.answers, kept];
    this.save();
    return this.send('answer', kept);
  }

  reply(id, reply) {
    const act = this.waiting.get(id);
    if (!act) return;
    this.waiting.delete(id);
    if (act.name === 'answer') {
      this.answers = this.answers.filter((given) => given.uid !== act.given.uid);
      this.save();
      for (const [other, one] of this.waiting) if (one.given.uid === act.given.uid) { this.waiting.delete(other); one.resolve(reply); }
    }
    act.resolve(reply);
  }
}
