// Words and numbers that several parts of the page need.
export const ACTIONS = ['NORTH', 'EAST', 'SOUTH', 'WEST'];
export const STEP = [[0, 1], [1, 0], [0, -1], [-1, 0]];
export const ANSWER = 0, SKIP = 1, UNSURE = 2, MIXED = 3, SPLIT = 4;
export const CONTRADICTION = 7;
const SIMULATED_S = 365 * 86400;

export function list(words) {
  if (words.length < 2) return words.join('');
  return `${words.slice(0, -1).join(', ')} and ${words[words.length - 1]}`;
}

export const names = (actions) => list(actions.map((action) => ACTIONS[action]));
export const percent = (share) => `${Math.round(100 * share)}\u00a0%`;
export const count = (number, word) => `${number} ${word}${number === 1 ? '' : 's'}`;

export function said(entry) {
  if (entry.verdict === ANSWER) return `${names(entry.preferred)}, not ${names(entry.avoided)}`;
  return ['', 'skipped', 'unsure', 'these cells differ', `split off ${count(entry.states.length, 'cell')}`][entry.verdict];
}

// What is wrong elsewhere if only right directions are named: the opposite of each, unless it is right too;
// where both opposites are right, the other two.
export function assumed(preferred) {
  const opposite = preferred.map((action) => (action + 2) % 4).filter((action) => !preferred.includes(action));
  return opposite.length ? opposite : [0, 1, 2, 3].filter((action) => !preferred.includes(action));
}

// Of a stamp; simulated time begins with 0 and has no date, so it is told as it runs.
export function clock(seconds) {
  if (seconds > SIMULATED_S) return new Date(1000 * seconds).toLocaleTimeString([], { hour: '2-digit', minute: '2-digit' });
  const two = (number) => String(Math.floor(number) % 60).padStart(2, '0');
  return `at ${Math.floor(seconds / 3600)}:${two(seconds / 60)}:${two(seconds)}`;
}

export function newId() {
  return Array.from(crypto.getRandomValues(new Uint8Array(12)), (byte) => byte.toString(16).padStart(2, '0')).join('');
}
