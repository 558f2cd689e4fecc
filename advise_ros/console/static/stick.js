// Keys, touch and gamepads as one stick: [east, north, up], each from -1 to 1.
import { mark, t } from '/console/language.js';

const KEYS = { ArrowUp: [0, 1, 0], ArrowRight: [1, 0, 0], ArrowDown: [0, -1, 0], ArrowLeft: [-1, 0, 0], PageUp: [0, 0, 1], PageDown: [0, 0, -1] };
const DEAD_ZONE = 0.15;
// Of the standard mapping: the cross, and the button that holds (B, or the circle).
const CROSS = { 12: [0, 1, 0], 13: [0, -1, 0], 14: [-1, 0, 0], 15: [1, 0, 0] }, HOLD = 1;

export const keyStick = (key) => KEYS[key];

export function fold(sticks) {
  const sum = [0, 0, 0];
  for (const stick of sticks) stick.forEach((value, axis) => { sum[axis] += value; });
  return sum.map((value) => Math.min(Math.max(value, -1), 1));
}

const size = (stick) => Math.max(...stick.map(Math.abs));

// Of several sticks the one that is moved most.
export function strongest(sticks) { return sticks.reduce((best, stick) => (size(stick) > size(best) ? stick : best)); }

export function gamepadStick(gamepad) {
  const axis = (index) => { const value = gamepad.axes[index] || 0; return Math.abs(value) < DEAD_ZONE ? 0 : value; };
  const crossed = Object.entries(CROSS).filter(([index]) => gamepad.buttons[index]?.pressed).map(([, stick]) => stick);
  return { stick: strongest([[axis(0), 0 - axis(1), 0 - axis(3)], fold(crossed)]), hold: Boolean(gamepad.buttons[HOLD]?.pressed) };
}

// How far outside the grid a place is, in cells, and on which side; null inside.
export function outsideBy(x, y, map) {
  const away = [[mark('east'), x - map.width], [mark('west'), -x], [mark('north'), y - map.height], [mark('south'), -y]].filter(([, cells]) => cells > 0);
  if (!away.length) return null;
  const [side, cells] = away.reduce((most, one) => (one[1] > most[1] ? one : most));
  return { side, cells };
}

export function lengthOf(seconds) {
  const minutes = Math.floor(seconds / 60), rest = Math.round(seconds % 60);
  return minutes ? t('{minutes} min {seconds} s', { minutes, seconds: rest }) : t('{seconds} s', { seconds: rest });
}
