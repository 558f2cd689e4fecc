// Words that several parts of the page need; texts themselves go through language.js.
import { clock as timeOfDay, list, t, tn } from '/console/language.js';

export const STEP = [[0, 1], [1, 0], [0, -1], [-1, 0]];
export const ANSWER = 0, SKIP = 1, UNSURE = 2, MIXED = 3, SPLIT = 4;
export const CONTRADICTION = 7;
const SIMULATED_S = 365 * 86400;

export const actionName = (action) => [t('NORTH'), t('EAST'), t('SOUTH'), t('WEST')][action];
export const names = (actions) => list(actions.map(actionName));
export const cells = (n) => tn('{n} cell', '{n} cells', n);
export const steps = (n) => tn('{n} step', '{n} steps', n);

export function said(entry) {
  if (entry.verdict === ANSWER) return t('{right}, not {wrong}', { right: names(entry.preferred), wrong: names(entry.avoided) });
  return ['', t('skipped'), t('unsure'), t('these cells differ'), tn('split off {n} cell', 'split off {n} cells', entry.states.length)][entry.verdict];
}

// What is wrong elsewhere if only right directions are named: the opposite of each, unless it is right too;
// where both opposites are right, the other two.
export function assumed(preferred) {
  const opposite = preferred.map((action) => (action + 2) % 4).filter((action) => !preferred.includes(action));
  return opposite.length ? opposite : [0, 1, 2, 3].filter((action) => !preferred.includes(action));
}

// The wall's time; simulated time has no time of day.
export const clock = (seconds) => (seconds > SIMULATED_S ? timeOfDay(seconds) : '');

// How many waypoints a route of states reaches, the final one included.
export function reached(route, map, reaches) {
  if (!route.length) return 0;
  return reaches ? map.layers : Math.floor(route[route.length - 1] / (map.width * map.height));
}

// Cells as the map's axes have them, counted from 1: 'columns 2-4, row 1'.
export function place(list, width) {
  const columns = list.map((cell) => (cell % width) + 1), rows = list.map((cell) => Math.floor(cell / width) + 1);
  const span = (values) => [Math.min(...values), Math.max(...values)];
  const [west, east] = span(columns), [south, north] = span(rows);
  const across = west === east ? t('column {from}', { from: west }) : t('columns {from}-{to}', { from: west, to: east });
  return `${across}, ${south === north ? t('row {from}', { from: south }) : t('rows {from}-{to}', { from: south, to: north })}`;
}

export function newId() {
  return Array.from(crypto.getRandomValues(new Uint8Array(12)), (byte) => byte.toString(16).padStart(2, '0')).join('');
}
