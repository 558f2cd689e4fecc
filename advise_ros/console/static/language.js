// Texts, numbers and times of day in the person's language. A text is its English wording: t('Your answer');
// '{name}' in it is replaced by what is given. The catalogue comes from the server.
import { shallowReactive, toRaw } from 'vue';

export const language = shallowReactive({ code: 'en', texts: {}, names: { en: 'English' } });

export function speak({ code, texts, names }) {
  Object.assign(language, { code, texts: toRaw(texts), names });
  document.documentElement.lang = code;
}

// Kept in a cookie, so that the next page comes in that language at once.
export async function choose(code) {
  document.cookie = `advise-language=${code}; path=/; max-age=31536000; SameSite=Strict`;
  const reply = await fetch(`/console-texts/${code}`);
  if (reply.ok) speak(await reply.json());
}

const fill = (text, given) => text.replace(/\{(\w+)\}/g, (whole, name) => (name in given ? given[name] : whole));

// A text whose place in the catalogue is known where it is shown.
export const mark = (text) => text;

export function t(text, given = {}) {
  const found = language.texts[text] ?? text;
  return fill(Array.isArray(found) ? found[0] : found, given);
}

// Of a number: the English for one, the English for others; {n} is the number.
export function tn(one, many, n, given = {}) {
  const found = language.texts[one], rules = new Intl.PluralRules(language.code);
  const at = rules.resolvedOptions().pluralCategories.indexOf(rules.select(n));
  const text = Array.isArray(found) ? found[Math.min(at, found.length - 1)] : n === 1 ? one : many;
  return fill(text, { n: number(n), ...given });
}

export const number = (value, digits = 0) => new Intl.NumberFormat(language.code, { minimumFractionDigits: digits, maximumFractionDigits: digits }).format(value);
export const percent = (share) => `${number(100 * share)}\u00a0%`;
export const list = (words) => new Intl.ListFormat(language.code, { type: 'conjunction' }).format(words);
export const clock = (seconds) => new Date(1000 * seconds).toLocaleTimeString(language.code, { hour: '2-digit', minute: '2-digit' });
