// Acts of the person on their way: an answer is kept until the server has replied to it, over losses and reloads;
// everything else is refused while there is no connection, so that no old wish to fly is carried out later.
import { language, t } from '/console/language.js';
import { newId } from '/console/words.js';

const STORE = 'advise-answers', GREET_AGAIN_MS = 3000;

export class Link {
  constructor(emit, changed) {
    this.emit = emit;
    this.changed = changed;
    this.up = false; // Acts arrive: the server has replied to this line's greeting.
    this.line = null; // The socket that was greeted, and when.
    this.greeted = 0;
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

  // Called often: a line that is new is greeted, and after a loss everything is asked for anew.
  look() {
    const line = this.open();
    if (line !== this.line) this.lose();
    if (line && (line !== this.line || (!this.up && performance.now() - this.greeted > GREET_AGAIN_MS))) {
      this.emit('hello', { line, again: this.line !== null });
      this.greeted = performance.now();
      this.line = line;
    }
    return this.up;
  }

  // Whether what was on its way has arrived is not known; answers are sent again, as they are taken once.
  lose() {
    this.up = false;
    for (const [id, act] of this.waiting) if (act.name !== 'answer') this.reply(id, { ok: false, message: t('the connection was lost; look whether it was done') });
  }

  open() { return window.socket?.connected && window.did_handshake ? window.socket.id : ''; }

  // The server has heard the greeting, so it hears what follows.
  welcome(line) {
    if (line !== this.open() || this.up) return;
    this.up = true;
    for (const given of this.answers) this.send('answer', given);
  }

  send(name, given) {
    const id = ++this.number;
    const reply = new Promise((resolve) => this.waiting.set(id, { name, given, resolve }));
    if (this.up && this.open() === this.line) this.emit('act', { id, name, given, language: language.code });
    else if (name !== 'answer') this.reply(id, { ok: false, message: t('there is no connection to the console; nothing was done') });
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
